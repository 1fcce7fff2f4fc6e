from pathlib import Path

from synfeal.config import Experiment
from synfeal.job import job
from synfeal.report.html.page import write_report

with job(snakemake.log[0]):
    rows = [Experiment(**row) for row in snakemake.params.rows]
    page = Path(snakemake.output.page)
    write_report(rows, snakemake.params.repetitions, page.parent, page)
