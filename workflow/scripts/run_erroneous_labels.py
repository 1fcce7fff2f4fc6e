"""Write the true poses of a split with an error (:func:`with_error`)."""

from baselines.labels.injected import write_erroneous_labels
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_erroneous_labels,
    error_kind=snakemake.wildcards.error_kind,
    truth=snakemake.input.truth,
    train=snakemake.input.train,
    noise_m=snakemake.wildcards.noise_m,
    noise_deg=snakemake.wildcards.noise_deg,
    dose=snakemake.params.dose,
    seed=snakemake.params.seed,
    out_labels=snakemake.output.labels,
)
