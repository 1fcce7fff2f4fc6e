"""Write poses that need no localizer, in the world of the sequence."""

from reproduction.real.stages import write_references
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_references,
    rendered=snakemake.params.rendered,
    train=snakemake.input.train,
    test=snakemake.input.test,
    truth=snakemake.input.truth,
    out_retrieval=snakemake.output.retrieval,
    out_nearest=snakemake.output.nearest,
    out_mean=snakemake.output.mean,
)
