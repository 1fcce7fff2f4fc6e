"""Score all poses and write the table, its LaTeX, and what the figures show."""

from reproduction.real.tables import write_real_tables
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_real_tables,
    config=snakemake.params.config,
    out_table=snakemake.output.table,
    out_tex=snakemake.output.tex,
    out_runs=snakemake.output.runs,
    out_amount=snakemake.output.amount,
    out_cover=snakemake.output.cover,
)
