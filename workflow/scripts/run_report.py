"""Write the page, one file that opens without a network."""

from pathlib import Path

from reproduction.report.html.page import write_report
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_report,
    design=snakemake.params.design,
    root=Path(snakemake.output.html).parent,
    out_html=snakemake.output.html,
    side_tables=snakemake.params.side_tables,
)
