"""Write what planned frames show, as depths of a collision mesh."""

from reproduction.runs.job import run_job
from synfeal.evaluation.reprojection import write_scene_depth

run_job(
    snakemake.log[0],
    write_scene_depth,
    collision=snakemake.input.collision,
    plan=snakemake.input.plan,
    camera=snakemake.params.camera,
    out_depth=snakemake.output.depth,
)
