"""Write which share of each photograph's pixels the scan covers, seen from the true pose."""

from reproduction.real.stages import write_cover
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_cover,
    scan=snakemake.input.scan,
    test=snakemake.input.test,
    out_cover=snakemake.output.cover,
)
