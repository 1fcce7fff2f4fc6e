from pathlib import Path

from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.job import job

with job(snakemake.log[0]):
    plan = read_pose_table(Path(snakemake.input.plan))
    write_pose_table(Path(snakemake.output.labels), plan.first(snakemake.params.n_frames))
