from pathlib import Path

from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sevenscenes import render_sequence
from synfeal.job import job

with job(snakemake.log[0]):
    render_sequence(
        Path(snakemake.input.mesh),
        CameraConfig(**snakemake.params.camera),
        read_pose_table(Path(snakemake.input.plan)).between(
            snakemake.params.start, snakemake.params.stop
        ),
        Path(snakemake.output.frames),
        snakemake.params.with_depth,
    )
