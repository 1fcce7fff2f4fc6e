from pathlib import Path

from synfeal.config.models import SceneConfig
from synfeal.job import job
from synfeal.scenes.prepare import prepare_scene

with job(snakemake.log[0]):
    prepare_scene(
        snakemake.wildcards.scene,
        SceneConfig(**snakemake.params.scene | {"path": snakemake.input.mesh or None}),
        snakemake.params.collision_agreement,
        snakemake.params.seed,
        Path(snakemake.output.mesh).parent,
    )
