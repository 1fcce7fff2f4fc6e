"""Write two rows, before and after assistance, per re-estimated label set and split."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.label_error import write_label_error_table

run_job(
    snakemake.log[0],
    write_label_error_table,
    design=snakemake.params.design,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
