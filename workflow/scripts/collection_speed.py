from pathlib import Path

from synfeal.collection.speed import write_collection_speed
from synfeal.config.models import CollectionConfig, RenderConfig, SceneConfig
from synfeal.job import job

with job(snakemake.log[0]):
    write_collection_speed(
        Path(snakemake.input.mesh),
        Path(snakemake.input.collision),
        SceneConfig(**snakemake.params.scene),
        CollectionConfig(**snakemake.params.collection),
        RenderConfig(**snakemake.params.render),
        snakemake.params.seed,
        Path(snakemake.output.speed),
    )
