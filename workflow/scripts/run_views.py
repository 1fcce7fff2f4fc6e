"""Reduce the first frames of a split to ``side`` (width, height), and write them."""

from baselines.references.features import write_views
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_views,
    sequences=snakemake.input.sequences,
    split=snakemake.wildcards.split,
    n_frames=snakemake.params.n_frames,
    camera=snakemake.params.camera,
    side=snakemake.params.side,
    out_views=snakemake.output.views,
    out_costs=snakemake.output.costs,
)
