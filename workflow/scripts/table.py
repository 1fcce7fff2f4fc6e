from pathlib import Path

from synfeal.config import Design
from synfeal.job import job
from synfeal.report.tables import write_table

with job(snakemake.log[0]):
    write_table(
        snakemake.wildcards.table,
        Design(**snakemake.params.design),
        Path(snakemake.output.csv).parents[1],
        Path(snakemake.output.csv),
        Path(snakemake.output.tex),
    )
