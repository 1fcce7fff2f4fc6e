"""Write one row per claim of the paper, columns :data:`COLUMNS`."""

from pathlib import Path

from reproduction.claims.table import write_claims
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_claims,
    design=snakemake.params.design,
    root=Path(snakemake.output.csv).parent,
    seed=snakemake.params.seed,
    out_csv=snakemake.output.csv,
)
