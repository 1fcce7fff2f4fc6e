from pathlib import Path

from synfeal.job import job
from synfeal.report.latex import write_document

with job(snakemake.log[0]):
    write_document([Path(path) for path in snakemake.input.tex], Path(snakemake.output.tex))
