from pathlib import Path

from synfeal.config import Design
from synfeal.job import job
from synfeal.report.html.page import write_report

with job(snakemake.log[0]):
    design = Design(**snakemake.params.design)
    page = Path(snakemake.output.page)
    write_report(design, page.parent, page)
