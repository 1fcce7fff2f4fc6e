from pathlib import Path

from synfeal.config import Experiment
from synfeal.job import job
from synfeal.report.assistance import write_assistance_table

with job(snakemake.log[0]):
    rows = [Experiment(**row) for row in snakemake.params.rows]
    csv, tex = Path(snakemake.output.csv), Path(snakemake.output.tex)
    write_assistance_table(rows, csv.parents[1], csv, tex)
