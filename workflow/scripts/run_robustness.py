"""Measure and write the table."""

from reproduction.runs.job import run_job
from reproduction.tables.robustness import write_robustness_table

run_job(
    snakemake.log[0],
    write_robustness_table,
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
    out_tex=snakemake.output.tex,
)
