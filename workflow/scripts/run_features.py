"""Find features in the first frames of a split, and write them."""

from baselines.references.features import write_features
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_features,
    sequences=snakemake.input.sequences,
    split=snakemake.wildcards.split,
    n_frames=snakemake.params.n_frames,
    camera=snakemake.params.camera,
    references=snakemake.params.references,
    out_features=snakemake.output.features,
    out_costs=snakemake.output.costs,
)
