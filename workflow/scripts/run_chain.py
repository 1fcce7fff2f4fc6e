"""Chain the batches of both splits, and record what the labels depend on."""

from baselines.labels.chain import write_label_set
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_label_set,
    reconstructed=snakemake.wildcards.reconstructed,
    train_batches=snakemake.input.train_batches,
    test_batches=snakemake.input.test_batches,
    train_truth=snakemake.input.train_truth,
    test_truth=snakemake.input.test_truth,
    estimation=snakemake.params.estimation,
    truth_used=snakemake.params.truth_used,
    parameters=snakemake.params.parameters,
    out_train=snakemake.output.train,
    out_test=snakemake.output.test,
    out_train_unassisted=snakemake.output.train_unassisted,
    out_test_unassisted=snakemake.output.test_unassisted,
    out_assistance=snakemake.output.assistance,
    out_record=snakemake.output.record,
)
