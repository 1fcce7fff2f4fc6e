from pathlib import Path

from baselines.references.features import find_features, write_features
from synfeal.config.models import CameraConfig, ReferencesConfig
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]):
    sequences = [Path(path) for path in snakemake.input.sequences]
    depth = None
    if snakemake.wildcards.split == "train":
        depth = frame_paths(sequences, "depth.png")[: params.n_frames]
    color = frame_paths(sequences, "color.png")[: params.n_frames]
    camera, references = CameraConfig(**params.camera), ReferencesConfig(**params.references)
    features = find_features(color, depth, camera, references)
    write_features(Path(snakemake.output.features), features)
