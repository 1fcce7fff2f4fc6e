"""Examine all cases and write one row for each; only the times differ between runs."""

from reproduction.hard_cases.table import write_hard_cases
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_hard_cases,
    out_csv=snakemake.output.csv,
)
