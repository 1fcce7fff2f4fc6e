"""Run our functions on all hard cases and write one row for each."""

from reproduction.hard_cases.table import write_hard_cases
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_hard_cases,
    out_csv=snakemake.output.csv,
)
