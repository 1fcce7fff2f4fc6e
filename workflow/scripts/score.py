from pathlib import Path

from baselines.training.score import score_common, score_run
from synfeal.config.models import CameraConfig
from synfeal.job import job

with job(snakemake.log[0]):
    score_run(
        Path(snakemake.input.predictions),
        Path(snakemake.input.labels),
        Path(snakemake.input.truth),
        Path(snakemake.input.train_labels),
        Path(snakemake.output.errors),
        Path(snakemake.output.metrics),
        dict(snakemake.wildcards),
        (Path(snakemake.input.depth), CameraConfig(**snakemake.params.camera)),
    )
    score_common(
        Path(snakemake.input.common),
        Path(snakemake.input.common_truth),
        Path(snakemake.output.common),
    )
