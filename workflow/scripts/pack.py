from pathlib import Path

from synfeal.dataset.packed import pack_frames
from synfeal.job import job

with job(snakemake.log[0]):
    sequences = [Path(path) for path in snakemake.input.sequences]
    pack_frames(sequences, snakemake.params.input_px, Path(snakemake.output.frames))
