import logging
import tempfile
from pathlib import Path

from baselines.groundtruth.sfm import sfm_batch
from baselines.groundtruth.trajectory import write_trajectory
from synfeal.config.models import CameraConfig, SfmConfig
from synfeal.dataset.pose_table import read_frames
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.files import write_json
from synfeal.job import job, refuse_restored

params = snakemake.params
with job(snakemake.log[0]), tempfile.TemporaryDirectory() as work_dir:
    refuse_restored(snakemake.input, snakemake.output[0])
    color = frame_paths(map(Path, snakemake.input.sequences), "color.png")[
        params.start : params.stop
    ]
    truth = read_frames(Path(snakemake.input.truth), params.start, params.stop)
    camera, sfm = CameraConfig(**params.camera), SfmConfig(**params.sfm)
    estimate = sfm_batch(color, camera, truth.world_from_cam, sfm, params.seed, Path(work_dir))
    logging.getLogger("sfm").info("%s", estimate.facts)
    write_json(Path(snakemake.output.facts), estimate.facts.to_json())
    write_trajectory(Path(snakemake.output.trajectory), estimate.trajectory)
