"""Write what a plan covers as JSON."""

from reproduction.runs.job import run_job
from synfeal.planning.coverage import write_coverage

run_job(
    snakemake.log[0],
    write_coverage,
    collision=snakemake.input.collision,
    scene=snakemake.params.scene,
    plan=snakemake.input.plan,
    camera=snakemake.params.camera,
    out_coverage=snakemake.output.coverage,
)
