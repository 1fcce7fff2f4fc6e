from pathlib import Path

from synfeal.config.models import CameraConfig, EffectsConfig, RenderConfig
from synfeal.job import job
from synfeal.scenes.effects_speed import write_effects_speed

params = snakemake.params
with job(snakemake.log[0]):
    write_effects_speed(
        Path(snakemake.input.mesh),
        Path(snakemake.input.plan),
        CameraConfig(**params.camera),
        RenderConfig(**params.render),
        {name: EffectsConfig(**effects) for name, effects in params.effects.items()},
        Path(snakemake.output.speed),
    )
