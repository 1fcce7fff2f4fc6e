from pathlib import Path

from synfeal.job import job
from synfeal.report.speed_vs_error import write_speed_vs_error

with job(snakemake.log[0]):
    out_csv = Path(snakemake.output.csv)
    write_speed_vs_error(snakemake.params.scenes, out_csv.parents[1], out_csv)
