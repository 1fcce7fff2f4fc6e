"""Draw photographs that were not scanned, renderings from their poses, and both overlaid."""

from reproduction.real.stages import write_comparison
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_comparison,
    scan=snakemake.input.scan,
    test=snakemake.input.test,
    out_picture=snakemake.output.picture,
)
