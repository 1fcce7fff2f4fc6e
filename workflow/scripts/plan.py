from pathlib import Path

import numpy as np

from synfeal.config.models import CollectionConfig, SceneConfig
from synfeal.dataset.pose_table import write_pose_table
from synfeal.job import job
from synfeal.planning.plan import plan_scene

with job(snakemake.log[0]):
    repeat = snakemake.input.repeat or None  # where it lies here
    table = plan_scene(
        Path(snakemake.input.collision),
        SceneConfig(**snakemake.params.scene),
        CollectionConfig(**snakemake.params.collection | {"repeat": repeat}),
        snakemake.params.n_frames,
        np.random.default_rng(snakemake.params.seed),
        snakemake.wildcards.split,
    )
    write_pose_table(Path(snakemake.output.plan), table)
