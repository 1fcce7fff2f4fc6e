"""Choose the level of detail for a camera, and write its mesh and how it was chosen."""

from reproduction.runs.job import run_job
from synfeal.collection.detail import write_detail

run_job(
    snakemake.log[0],
    write_detail,
    mesh=snakemake.input.mesh,
    plans=snakemake.input.plans,
    camera=snakemake.params.camera,
    render=snakemake.params.render,
    out_mesh=snakemake.output.mesh,
    out_record=snakemake.output.record,
)
