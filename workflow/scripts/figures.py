from pathlib import Path

from synfeal.config import Experiment
from synfeal.job import job
from synfeal.report.figures import Results, write_figures

with job(snakemake.log[0]):
    out_dir = Path(snakemake.output.figures)
    rows = tuple(Experiment(**row) for row in snakemake.params.rows)
    write_figures(Results(out_dir.parent, rows, snakemake.params.repetitions), out_dir)
