"""Write the effects that the paper claims, as this run has them, and a verdict on each claim."""

from pathlib import Path

from reproduction.claims.run import write_run_claims
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_run_claims,
    design=snakemake.params.design,
    root=Path(snakemake.output.csv).parent,
)
