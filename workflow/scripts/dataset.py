from pathlib import Path

from synfeal.config.models import CameraConfig
from synfeal.dataset.manifest import write_manifest
from synfeal.dataset.sequences import sequences_of
from synfeal.dataset.sevenscenes import write_splits
from synfeal.job import job

with job(snakemake.log[0]):
    directory = Path(snakemake.output.manifest).parent
    sequences = sequences_of(*snakemake.params.counts, snakemake.params.shard_frames)
    write_splits(directory, sequences)
    params = snakemake.params
    origin = {"scene": snakemake.wildcards.scene, "seed": params.seed, "render": params.render}
    write_manifest(directory, sequences, CameraConfig(**snakemake.params.camera), origin)
