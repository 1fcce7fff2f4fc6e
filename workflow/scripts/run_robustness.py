"""Measure how well methods stand effects: rows of the robustness table."""

from reproduction.runs.job import run_job
from reproduction.tables.robustness import write_robustness_scores

run_job(
    snakemake.log[0],
    write_robustness_scores,
    clean=snakemake.input.clean,
    mixed=snakemake.input.mixed,
    descriptors=snakemake.input.descriptors,
    structure=snakemake.input.structure,
    test=snakemake.input.test,
    varied=snakemake.input.varied,
    labels=snakemake.input.labels,
    effects=snakemake.params.effects,
    device=snakemake.params.device,
    out_csv=snakemake.output.csv,
)
