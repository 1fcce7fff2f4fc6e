from pathlib import Path

from synfeal.config.models import CameraConfig, RenderConfig, RenderSpeedConfig
from synfeal.job import job
from synfeal.scenes.render_speed import measured_cameras, write_render_speed

with job(snakemake.log[0]):
    measured = RenderSpeedConfig(**snakemake.params.render_speed)
    write_render_speed(
        Path(snakemake.input.mesh),
        Path(snakemake.input.plan),
        measured_cameras(
            CameraConfig(**snakemake.params.network_camera),
            CameraConfig(**snakemake.params.groundtruth_camera),
            measured.sizes,
        ),
        measured.poses,
        RenderConfig(**snakemake.params.render),
        Path(snakemake.output.speed),
    )
