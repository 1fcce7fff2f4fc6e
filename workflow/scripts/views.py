from pathlib import Path

from baselines.references.views import read_frames, write_views
from synfeal.config.models import CameraConfig
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]):
    sequences = [Path(path) for path in snakemake.input.sequences]
    depth = None
    if snakemake.wildcards.split == "train":
        depth = frame_paths(sequences, "depth.png")[: params.n_frames]
    color = frame_paths(sequences, "color.png")[: params.n_frames]
    views = read_frames(color, depth, CameraConfig(**params.camera), *params.side)
    write_views(Path(snakemake.output.views), views)
