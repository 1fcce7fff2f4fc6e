"""Train a localizer, predict its test frames, and score the predictions."""

from reproduction.runs.job import run_job, uncollected

with uncollected():
    from baselines.training.experiment import train_and_score

run_job(
    snakemake.log[0],
    train_and_score,
    model=snakemake.wildcards.model,
    frames=snakemake.input.frames,
    labels=snakemake.input.labels,
    test_frames=snakemake.input.test_frames,
    test_labels=snakemake.input.test_labels,
    run=snakemake.params.run,
    truth=snakemake.input.truth,
    depth=snakemake.input.depth,
    camera=snakemake.params.camera,
    common=snakemake.input.common,
    every=snakemake.params.every,
    wildcards=dict(snakemake.wildcards.items()),
    out_model=snakemake.output.model,
    out_history=snakemake.output.history,
    out_record=snakemake.output.record,
    out_predictions=snakemake.output.predictions,
    out_common=snakemake.output.common,
    out_errors=snakemake.output.errors,
    out_common_errors=snakemake.output.common_errors,
    out_metrics=snakemake.output.metrics,
    weights=snakemake.input.weights or None,
)
