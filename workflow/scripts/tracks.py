from pathlib import Path

from baselines.references.tracks import write_tracks
from synfeal.job import job

with job(snakemake.log[0]):
    descriptors, train = Path(snakemake.input.descriptors), Path(snakemake.input.train)
    write_tracks(descriptors, train, Path(snakemake.output.tracks))
