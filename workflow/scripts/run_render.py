"""Render poses of a table into a new sequence, which appears when it is complete."""

from reproduction.runs.job import run_job
from synfeal.dataset.render_sequence import render_sequence

run_job(
    snakemake.log[0],
    render_sequence,
    mesh=snakemake.input.mesh,
    camera=snakemake.params.camera,
    plan=snakemake.input.plan,
    start=snakemake.params.start,
    stop=snakemake.params.stop,
    with_depth=snakemake.params.with_depth,
    with_normals=snakemake.params.with_normals,
    with_masks=snakemake.params.with_masks,
    render=snakemake.params.render,
    out_frames=snakemake.output.frames,
    detail=snakemake.input.detail or None,
)
