"""Write one row per cell of any table; in LaTeX those whose labels are true poses."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.recall import write_recall_table

run_job(
    snakemake.log[0],
    write_recall_table,
    design=snakemake.params.design,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
