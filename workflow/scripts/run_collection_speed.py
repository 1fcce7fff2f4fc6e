"""Collect 100 frames of 640 x 480 in four parts and write how fast each was."""

from reproduction.runs.job import run_job
from reproduction.speed.collection import write_collection_speed

run_job(
    snakemake.log[0],
    write_collection_speed,
    mesh=snakemake.input.mesh,
    collision=snakemake.input.collision,
    scene=snakemake.params.scene,
    collection=snakemake.params.collection,
    render=snakemake.params.render,
    seed=snakemake.params.seed,
    out_speed=snakemake.output.speed,
)
