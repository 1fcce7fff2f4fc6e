from pathlib import Path

from synfeal.config.models import CameraConfig
from synfeal.dataset.finish import finish
from synfeal.dataset.pose_table import read_frames, write_pose_table
from synfeal.files import read_json, write_json
from synfeal.job import job

with job(snakemake.log[0]):
    params = snakemake.params
    directory = Path(snakemake.output.manifest).parent
    splits = [split for split, count in params.counts.items() if count]
    for split, plan in zip(splits, snakemake.input.plans, strict=True):
        write_pose_table(
            directory / f"{split}.csv", read_frames(Path(plan), 0, params.counts[split])
        )
    if snakemake.input.coverage:
        covered = zip(splits, snakemake.input.coverage, strict=True)
        write_json(directory / "coverage.json", {s: read_json(Path(path)) for s, path in covered})
    camera, mesh = CameraConfig(**params.camera), Path(snakemake.input.mesh)
    finish(directory, params.counts, params.shard_frames, camera, mesh, params.origin)
