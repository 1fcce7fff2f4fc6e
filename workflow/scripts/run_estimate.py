"""Write :func:`estimate_batch` of the frames ``start`` to ``stop`` of a split."""

from baselines.labels.methods import write_estimate
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_estimate,
    frame_method=snakemake.wildcards.frame_method,
    sequences=snakemake.input.sequences,
    start=snakemake.params.start,
    stop=snakemake.params.stop,
    camera=snakemake.params.camera,
    estimation=snakemake.params.estimation,
    seed=snakemake.params.seed,
    out_trajectory=snakemake.output.trajectory,
    out_facts=snakemake.output.facts,
)
