"""Write the pose graph of the frames ``start`` to ``stop`` of a split, and what it took."""

from baselines.labels.rgbd.graph import write_rgbd
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_rgbd,
    sequences=snakemake.input.sequences,
    start=snakemake.params.start,
    stop=snakemake.params.stop,
    camera=snakemake.params.camera,
    rgbd=snakemake.params.rgbd,
    seed=snakemake.params.seed,
    out_graph=snakemake.output.graph,
    out_facts=snakemake.output.facts,
)
