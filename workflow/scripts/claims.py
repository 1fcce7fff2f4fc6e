from pathlib import Path

from synfeal.config import Experiment
from synfeal.job import job
from synfeal.report.claims.table import write_claims

with job(snakemake.log[0]):
    out = Path(snakemake.output.csv)
    rows = [Experiment(**row) for row in snakemake.params.rows]
    write_claims(rows, snakemake.params.repetitions, out.parent, out)
