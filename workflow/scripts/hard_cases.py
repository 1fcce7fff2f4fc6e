from pathlib import Path

from synfeal.job import job
from synfeal.report.hard_cases.table import write_hard_cases

with job(snakemake.log[0]):
    write_hard_cases(Path(snakemake.output.csv))
