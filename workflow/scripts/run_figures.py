"""Write every figure whose inputs the design makes, as SVG and PNG; their names."""

from pathlib import Path

from reproduction.figures.registry import write_figures
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_figures,
    design=snakemake.params.design,
    root=Path(snakemake.output.dir).parent,
    out_dir=snakemake.output.dir,
)
