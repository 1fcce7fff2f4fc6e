"""Write one of tables 2 to 7 from the scores of its runs: a row per cell, and LaTeX."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.write import write_table

run_job(
    snakemake.log[0],
    write_table,
    table=snakemake.wildcards.table,
    design=snakemake.params.design,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
