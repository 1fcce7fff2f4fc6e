from pathlib import Path

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_frames
from synfeal.dataset.render_sequence import render_packed
from synfeal.job import job

with job(snakemake.log[0]):
    render_packed(
        Path(snakemake.input.mesh),
        CameraConfig(**snakemake.params.camera),
        read_frames(Path(snakemake.input.plan), snakemake.params.start, snakemake.params.stop),
        snakemake.params.input_px,
        Path(snakemake.output.frames),
        RenderConfig(**snakemake.params.render),
        snakemake.params.view,
    )
