"""Describe packed frames as wholes."""

from baselines.references.descriptors import write_descriptors
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_descriptors,
    files=dict(snakemake.input.items()),
    learned_from=snakemake.params.learned_from,
    seed=snakemake.params.seed,
    out_descriptors=snakemake.output.descriptors,
    out_costs=snakemake.output.costs,
)
