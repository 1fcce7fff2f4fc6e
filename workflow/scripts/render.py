from pathlib import Path

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_frames
from synfeal.dataset.render_sequence import render_sequence
from synfeal.job import job

with job(snakemake.log[0]):
    render_sequence(
        Path(snakemake.input.mesh),
        CameraConfig(**snakemake.params.camera),
        read_frames(Path(snakemake.input.plan), snakemake.params.start, snakemake.params.stop),
        Path(snakemake.output.frames),
        snakemake.params.with_depth,
        RenderConfig(**snakemake.params.render),
    )
