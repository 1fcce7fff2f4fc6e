"""Train a localizer, and predict the test frames it is scored on."""

from reproduction.runs.job import run_job, uncollected

with uncollected():
    from baselines.training.run import train_and_predict

given, made = snakemake.input, snakemake.output
run_job(
    snakemake.log[0],
    train_and_predict,
    model=snakemake.wildcards.model,
    train={"frames": given.frames, "labels": given.labels},
    test={"frames": given.test_frames, "labels": given.test_labels},
    run=snakemake.params.run,
    out={
        "model": made.model,
        "history": made.history,
        "record": made.record,
        "predictions": made.predictions,
    },
    weights=given.weights or None,
)
