from pathlib import Path

from synfeal.config.models import CameraConfig, SceneConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.files import write_json
from synfeal.job import job
from synfeal.planning.coverage import scene_coverage

with job(snakemake.log[0]):
    coverage = scene_coverage(
        Path(snakemake.input.collision),
        SceneConfig(**snakemake.params.scene),
        read_pose_table(Path(snakemake.input.plan)),
        CameraConfig(**snakemake.params.camera),
    )
    write_json(Path(snakemake.output.coverage), coverage)
