"""Write the scores of all reference methods and localizers, data set by data set."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.references import write_references_table

run_job(
    snakemake.log[0],
    write_references_table,
    design=snakemake.params.design,
    references=snakemake.params.references,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
