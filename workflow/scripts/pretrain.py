from pathlib import Path

from baselines.training.pretrain import pretrain_backbone
from synfeal.config.models import NetworkConfig, PretrainingConfig
from synfeal.job import job

with job(snakemake.log[0]):
    pretext = bool(snakemake.input.frames)
    pretrain_backbone(
        snakemake.wildcards.backbone,
        Path(str(snakemake.input.frames)) if pretext else None,
        Path(str(snakemake.input.labels)) if pretext else None,
        NetworkConfig(**snakemake.params.network),
        PretrainingConfig(**snakemake.params.pretraining),
        snakemake.params.seed,
        Path(snakemake.output.weights),
    )
