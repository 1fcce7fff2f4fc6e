"""Write the trajectory of the frames ``start`` to ``stop`` of a split, and what it took."""

from baselines.labels.sfm.batch import write_sfm
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_sfm,
    sequences=snakemake.input.sequences,
    truth=snakemake.input.truth,
    start=snakemake.params.start,
    stop=snakemake.params.stop,
    camera=snakemake.params.camera,
    sfm=snakemake.params.sfm,
    seed=snakemake.params.seed,
    out_trajectory=snakemake.output.trajectory,
    out_facts=snakemake.output.facts,
)
