"""Train a localizer, predict its test frames, and score the predictions."""

from reproduction.runs.job import run_job, uncollected

with uncollected():
    from baselines.training.experiment import train_and_score

given, made = snakemake.input, snakemake.output
run_job(
    snakemake.log[0],
    train_and_score,
    model=snakemake.wildcards.model,
    train={"frames": given.frames, "labels": given.labels},
    test={"frames": given.test_frames, "labels": given.test_labels},
    common={"truth": given.common, "every": snakemake.params.every, "out": made.common},
    run=snakemake.params.run,
    out={
        "model": made.model,
        "history": made.history,
        "record": made.record,
        "predictions": made.predictions,
    },
    scoring={
        "truth": given.truth,
        "depth": given.depth,
        "camera": snakemake.params.camera,
        "wildcards": dict(snakemake.wildcards.items()),
        "out_errors": made.errors,
        "out_common_errors": made.common_errors,
        "out_metrics": made.metrics,
    },
    weights=given.weights or None,
)
