"""Write one row per re-estimated label set and split, and one of both splits together."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.assistance import write_assistance_table

run_job(
    snakemake.log[0],
    write_assistance_table,
    design=snakemake.params.design,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
