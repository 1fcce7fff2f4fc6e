"""Score the predictions of a training run."""

from baselines.training.score import write_scores
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_scores,
    predictions=snakemake.input.predictions,
    labels=snakemake.input.labels,
    truth=snakemake.input.truth,
    train_labels=snakemake.input.train_labels,
    depth=snakemake.input.depth,
    camera=snakemake.params.camera,
    common=snakemake.input.common,
    common_truth=snakemake.input.common_truth,
    wildcards=dict(snakemake.wildcards.items()),
    out_errors=snakemake.output.errors,
    out_metrics=snakemake.output.metrics,
    out_common_errors=snakemake.output.common_errors,
)
