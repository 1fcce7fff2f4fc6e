"""Run somebody else's localizer, or take its file of answers, and score it."""

from baselines.references.run import answer_externally
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    answer_externally,
    files={name: file for name, file in snakemake.input.items() if file},
    method=snakemake.params.method,
    named=snakemake.params.named,
    wildcards=dict(snakemake.wildcards.items()),
    out_references=snakemake.output.references,
)
