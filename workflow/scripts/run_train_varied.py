"""Train a localizer, and predict the test frames it is scored on."""

from reproduction.runs.job import run_job, uncollected

with uncollected():
    from baselines.training.run import train_and_predict

run_job(
    snakemake.log[0],
    train_and_predict,
    model=snakemake.wildcards.model,
    frames=snakemake.input.frames,
    labels=snakemake.input.labels,
    test_frames=snakemake.input.test_frames,
    test_labels=snakemake.input.test_labels,
    run=snakemake.params.run,
    out_model=snakemake.output.model,
    out_history=snakemake.output.history,
    out_record=snakemake.output.record,
    out_predictions=snakemake.output.predictions,
    weights=snakemake.input.weights or None,
)
