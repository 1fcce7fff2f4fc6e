from pathlib import Path

from synfeal.collection.speed import write_collection_speed
from synfeal.config.models import CollectionConfig, RenderConfig, SceneConfig
from synfeal.job import job

with job(snakemake.log[0]):
    repeat = snakemake.input.repeat or None  # where it lies here
    write_collection_speed(
        Path(snakemake.input.mesh),
        Path(snakemake.input.collision),
        SceneConfig(**snakemake.params.scene),
        CollectionConfig(**snakemake.params.collection | {"repeat": repeat}),
        RenderConfig(**snakemake.params.render),
        snakemake.params.seed,
        Path(snakemake.output.speed),
    )
