"""Write Table 1 from the properties of the scenes' meshes: a row per scene, ``SCHEMA``."""

from pathlib import Path

from reproduction.runs.job import run_job
from reproduction.tables.meshes import write_meshes_table

run_job(
    snakemake.log[0],
    write_meshes_table,
    scenes=snakemake.params.scenes,
    root=Path(snakemake.output.csv).parents[1],
    out_csv=snakemake.output.csv,
    out_tex=snakemake.output.tex,
)
