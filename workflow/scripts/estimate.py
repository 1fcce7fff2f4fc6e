from pathlib import Path

from baselines.groundtruth.methods import estimate_batch
from baselines.groundtruth.trajectory import write_trajectory
from synfeal.config.models import CameraConfig, GroundTruthConfig
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.files import write_json
from synfeal.job import job, refuse_restored

params = snakemake.params
with job(snakemake.log[0]):
    refuse_restored(snakemake.input, snakemake.output[0])
    sequences = [Path(path) for path in snakemake.input.sequences]
    color = frame_paths(sequences, "color.png")[params.start : params.stop]
    depth = frame_paths(sequences, "depth.png")[params.start : params.stop]
    trajectory, facts = estimate_batch(
        snakemake.wildcards.frame_method,
        *(color, depth, CameraConfig(**params.camera)),
        GroundTruthConfig(**params.groundtruth),
        params.seed,
    )
    write_json(Path(snakemake.output.facts), facts)
    write_trajectory(Path(snakemake.output.trajectory), trajectory)
