from pathlib import Path

from synfeal.dataset.pose_table import read_frames, write_pose_table
from synfeal.job import job

with job(snakemake.log[0]):
    plan = read_frames(Path(snakemake.input.plan), 0, snakemake.params.n_frames)
    write_pose_table(Path(snakemake.output.labels), plan)
