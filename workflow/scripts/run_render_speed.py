"""Measure on poses spread evenly over a plan, and write the rows; times differ between runs."""

from reproduction.runs.job import run_job
from reproduction.speed.rendering import write_render_speed

run_job(
    snakemake.log[0],
    write_render_speed,
    mesh=snakemake.input.mesh,
    plan=snakemake.input.plan,
    cameras=snakemake.params.cameras,
    details=snakemake.input.details,
    records=snakemake.input.records,
    render_speed=snakemake.params.render_speed,
    render=snakemake.params.render,
    out_speed=snakemake.output.speed,
)
