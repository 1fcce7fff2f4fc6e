"""Match each test frame with the training frames that look most alike, and write the matches."""

from baselines.references.correspondences import write_matches
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_matches,
    descriptors=snakemake.input.descriptors,
    train=snakemake.input.train,
    test=snakemake.input.test,
    retrieved=snakemake.params.retrieved,
    out_matches=snakemake.output.matches,
    out_costs=snakemake.output.costs,
)
