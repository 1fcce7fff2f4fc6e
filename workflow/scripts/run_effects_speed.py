"""Write a row for ideal frames and one for each of the effects; times differ between runs."""

from reproduction.runs.job import run_job
from reproduction.speed.collection import write_effects_speed

run_job(
    snakemake.log[0],
    write_effects_speed,
    mesh=snakemake.input.mesh,
    plan=snakemake.input.plan,
    camera=snakemake.params.camera,
    render=snakemake.params.render,
    effects=snakemake.params.effects,
    out_csv=snakemake.output.csv,
)
