from pathlib import Path

from synfeal.config import Design
from synfeal.job import job
from synfeal.report.figures import Results, write_figures

with job(snakemake.log[0]):
    out_dir = Path(snakemake.output.figures)
    write_figures(Results(out_dir.parent, Design(**snakemake.params.design)), out_dir)
