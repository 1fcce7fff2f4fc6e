import tempfile
from pathlib import Path

from baselines.groundtruth.sfm import sfm_batch
from baselines.groundtruth.trajectory import write_trajectory
from synfeal.config.models import CameraConfig, SfmConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]), tempfile.TemporaryDirectory() as work_dir:
    color = frame_paths(map(Path, snakemake.input.sequences), "color.png")[
        params.start : params.stop
    ]
    truth = read_pose_table(Path(snakemake.input.truth)).between(params.start, params.stop)
    camera, sfm = CameraConfig(**params.camera), SfmConfig(**params.sfm)
    trajectory = sfm_batch(color, camera, truth.world_from_cam, sfm, params.seed, Path(work_dir))
    write_trajectory(Path(snakemake.output.trajectory), trajectory)
