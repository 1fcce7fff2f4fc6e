from pathlib import Path

from synfeal.job import job
from synfeal.report.document import write_report_document

with job(snakemake.log[0]):
    out = Path(snakemake.output.tex)
    write_report_document(out.parent, [Path(path) for path in snakemake.input.tex], out)
