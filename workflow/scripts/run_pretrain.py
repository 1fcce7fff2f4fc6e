"""Write the state dict that ``init: pretrained`` starts from."""

from reproduction.runs.job import run_job, uncollected

with uncollected():
    from baselines.training.pretrain import pretrain_backbone

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
