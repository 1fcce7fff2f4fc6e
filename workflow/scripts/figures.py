from pathlib import Path

from synfeal.job import job
from synfeal.report.figures import write_figures

with job(snakemake.log[0]):
    write_figures(Path(snakemake.output.figures).parent / "tables", Path(snakemake.output.figures))
