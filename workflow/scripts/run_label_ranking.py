"""Write how labels rank methods, beside how the truth does."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.label_ranking import write_label_ranking_table

run_job(
    snakemake.log[0],
    write_label_ranking_table,
    design=snakemake.params.design,
    references=snakemake.params.references,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
