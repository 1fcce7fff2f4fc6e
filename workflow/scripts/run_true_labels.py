"""Write the first frames of a pose table as one of their own."""

from reproduction.runs.job import run_job
from synfeal.dataset.pose_table import write_first_frames

run_job(
    snakemake.log[0],
    write_first_frames,
    plan=snakemake.input.plan,
    n_frames=snakemake.params.n_frames,
    out_labels=snakemake.output.labels,
)
