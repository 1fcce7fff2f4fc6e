from pathlib import Path

from synfeal.config import Design
from synfeal.job import job
from synfeal.report.claims.table import write_claims

with job(snakemake.log[0]):
    out = Path(snakemake.output.csv)
    write_claims(Design(**snakemake.params.design), out.parent, out)
