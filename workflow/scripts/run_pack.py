"""Join parts of packed frames, and write ``.json`` beside them in place of ``.npy``."""

from reproduction.runs.job import run_job
from synfeal.dataset.packed import write_packed

run_job(
    snakemake.log[0],
    write_packed,
    plan=snakemake.input.plan,
    shards=snakemake.input.shards,
    records=snakemake.input.records,
    camera=snakemake.params.camera,
    render=snakemake.params.render,
    view=snakemake.params.view,
    out_frames=snakemake.output.frames,
    detail=snakemake.input.detail or None,
)
