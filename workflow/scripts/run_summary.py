"""Write checks, then every table beside the paper's; and what a person sees when a run ends."""

from pathlib import Path

from reproduction.report.summary import write_summary
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_summary,
    design=snakemake.params.design,
    root=Path(snakemake.output.md).parent,
    out_md=snakemake.output.md,
)
