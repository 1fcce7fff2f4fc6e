from pathlib import Path

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.dataset.packed import join_packed, write_packed_record
from synfeal.job import job

with job(snakemake.log[0]):
    frames = Path(snakemake.output.frames)
    join_packed([Path(path) for path in snakemake.input.shards], frames)
    write_packed_record(
        frames,
        [Path(path) for path in snakemake.input.records],
        Path(snakemake.input.plan),
        CameraConfig(**snakemake.params.camera),
        RenderConfig(**snakemake.params.render),
        snakemake.params.view,
    )
