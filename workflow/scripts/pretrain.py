from pathlib import Path

from baselines.training.pretrain import pretrain_backbone
from synfeal.config.models import NetworkConfig, PretrainingConfig
from synfeal.job import job

with job(snakemake.log[0]):
    frames, labels = map(Path, snakemake.input.frames), map(Path, snakemake.input.labels)
    pretrain_backbone(
        snakemake.wildcards.backbone,
        list(zip(frames, labels, strict=True)),
        NetworkConfig(**snakemake.params.network),
        PretrainingConfig(**snakemake.params.pretraining),
        snakemake.params.seed,
        Path(snakemake.output.weights),
    )
