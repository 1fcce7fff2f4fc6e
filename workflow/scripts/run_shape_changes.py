"""Compare label errors of one size by their shape, frame by frame."""

from pathlib import Path

from reproduction.claims.label_shapes import write_shape_changes
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_shape_changes,
    design=snakemake.params.design,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
