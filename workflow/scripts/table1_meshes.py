from pathlib import Path

from synfeal.job import job
from synfeal.report.meshes import write_meshes_table

with job(snakemake.log[0]):
    write_meshes_table(
        snakemake.params.scenes,
        Path(snakemake.output.csv).parents[1],
        Path(snakemake.output.csv),
        Path(snakemake.output.tex),
    )
