from pathlib import Path

from synfeal.config import Experiment
from synfeal.job import job
from synfeal.report.assistance import write_assistance_table

with job(snakemake.log[0]):
    rows = [Experiment(**row) for row in snakemake.params.rows]
    write_assistance_table(rows, Path(snakemake.output.csv).parents[1], Path(snakemake.output.csv))
