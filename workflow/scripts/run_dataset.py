"""Write what is made of all frames together beside the sequences of a data set."""

from reproduction.runs.job import run_job
from synfeal.dataset.finish import finish_dataset

run_job(
    snakemake.log[0],
    finish_dataset,
    mesh=snakemake.input.mesh,
    plans=snakemake.input.plans,
    camera=snakemake.params.camera,
    counts=snakemake.params.counts,
    shard_frames=snakemake.params.shard_frames,
    origin=snakemake.params.origin,
    out_manifest=snakemake.output.manifest,
    coverage=snakemake.input.coverage,
    detail=snakemake.input.detail or None,
)
