"""Make a data set of the first training frames of another; images are links."""

from reproduction.real.stages import write_prefix
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_prefix,
    dataset=snakemake.params.dataset,
    frames=snakemake.wildcards.frames,
    out_dataset=snakemake.output.dataset,
)
