"""Draw both figures."""

from reproduction.real.figures import write_real_figures
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_real_figures,
    amount=snakemake.input.amount,
    cover=snakemake.input.cover,
    out_amount=snakemake.output.amount,
    out_shares=snakemake.output.shares,
)
