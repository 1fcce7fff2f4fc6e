"""Write a side table, CSV and LaTeX, by the class that its name declares."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.side import write_side_table

run_job(
    snakemake.log[0],
    write_side_table,
    side=snakemake.wildcards.side,
    design=snakemake.params.design,
    settings=snakemake.params.settings,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
