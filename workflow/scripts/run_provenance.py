"""Write the record, and beside it what every job took, ``benchmarks.csv``."""

from reproduction.report.html.provenance import write_provenance
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_provenance,
    seed=snakemake.params.seed,
    config_hash=snakemake.params.config_hash,
    measured=snakemake.input.measured,
    results=snakemake.input.results,
    out_json=snakemake.output.json,
)
