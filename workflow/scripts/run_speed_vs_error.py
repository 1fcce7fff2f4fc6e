"""Write one row per stage, scene and variant; ``chosen`` is 1 where the pipeline uses it."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.speed_vs_error import write_speed_vs_error

run_job(
    snakemake.log[0],
    write_speed_vs_error,
    scenes=snakemake.params.scenes,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
)
