from pathlib import Path

from baselines.references.split import files_of_split
from baselines.references.views import read_frames, write_views
from synfeal.config.models import CameraConfig
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]):
    sequences = [Path(path) for path in snakemake.input.sequences]
    color, depth = files_of_split(sequences, snakemake.wildcards.split, params.n_frames)
    views = read_frames(color, depth, CameraConfig(**params.camera), *params.side)
    write_views(Path(snakemake.output.views), views)
