"""Match training frames with each other, and write the tracks."""

from baselines.references.correspondences import write_tracks
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_tracks,
    descriptors=snakemake.input.descriptors,
    train=snakemake.input.train,
    out_tracks=snakemake.output.tracks,
)
