from pathlib import Path

from baselines.references.features import find_features, write_features
from baselines.references.split import files_of_split
from synfeal.config.models import CameraConfig, ReferencesConfig
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]):
    sequences = [Path(path) for path in snakemake.input.sequences]
    color, depth = files_of_split(sequences, snakemake.wildcards.split, params.n_frames)
    camera, references = CameraConfig(**params.camera), ReferencesConfig(**params.references)
    features = find_features(color, depth, camera, references)
    write_features(Path(snakemake.output.features), features)
