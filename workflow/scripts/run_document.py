"""Write a complete document that holds the given tables, in order, and nothing else."""

from reproduction.report.document import write_document
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_document,
    tables=snakemake.input.tables,
    out_tex=snakemake.output.tex,
)
