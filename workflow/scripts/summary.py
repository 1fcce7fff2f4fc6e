from pathlib import Path

from synfeal.config import Design
from synfeal.files import atomic_path
from synfeal.job import job
from synfeal.report.summary import write_summary

with job(snakemake.log[0]):
    design = Design(**snakemake.params.design)
    page = Path(snakemake.output.page)
    text = write_summary(design, page.parent, page)
    with atomic_path(Path(snakemake.output.text)) as temporary:
        temporary.write_text(text, encoding="utf-8")
