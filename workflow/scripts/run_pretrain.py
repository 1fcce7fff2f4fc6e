"""Write the state dict that ``init: pretrained`` starts from."""

from baselines.training.pretrain import pretrain_backbone
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    pretrain_backbone,
    backbone=snakemake.wildcards.backbone,
    network=snakemake.params.network,
    pretraining=snakemake.params.pretraining,
    seed=snakemake.params.seed,
    out_weights=snakemake.output.weights,
    frames=snakemake.input.frames,
    labels=snakemake.input.labels,
)
