"""Render rows ``start`` to ``stop`` of a plan into one array, as :func:`pack_frames` packs."""

from reproduction.runs.job import run_job
from synfeal.dataset.render_sequence import render_packed

run_job(
    snakemake.log[0],
    render_packed,
    mesh=snakemake.input.mesh,
    camera=snakemake.params.camera,
    plan=snakemake.input.plan,
    start=snakemake.params.start,
    stop=snakemake.params.stop,
    input_px=snakemake.params.input_px,
    view=snakemake.params.view,
    render=snakemake.params.render,
    out_frames=snakemake.output.frames,
    detail=snakemake.input.detail or None,
)
