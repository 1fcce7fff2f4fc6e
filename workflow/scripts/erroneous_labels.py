from pathlib import Path

import numpy as np

from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.job import job
from synfeal.labels.errors import with_error

with job(snakemake.log[0]):
    labels = with_error(
        snakemake.wildcards.error_kind,
        read_pose_table(Path(snakemake.input.truth)),
        read_pose_table(Path(snakemake.input.train)),
        float(snakemake.wildcards.noise_m),
        float(snakemake.wildcards.noise_deg),
        np.random.default_rng(snakemake.params.seed),
    )
    write_pose_table(Path(snakemake.output.labels), labels)
