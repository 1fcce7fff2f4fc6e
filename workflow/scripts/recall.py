from pathlib import Path

from synfeal.config import Design
from synfeal.job import job
from synfeal.report.recall import write_recall_table

with job(snakemake.log[0]):
    csv, tex = Path(snakemake.output.csv), Path(snakemake.output.tex)
    write_recall_table(Design(**snakemake.params.design), csv.parents[1], csv, tex)
