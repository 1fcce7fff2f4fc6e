"""Write the built-in objects of a scene beside its mesh."""

from reproduction.runs.job import run_job
from synfeal.collection.prepare import save_cartons

run_job(
    snakemake.log[0],
    save_cartons,
    mesh=snakemake.input.mesh,
)
