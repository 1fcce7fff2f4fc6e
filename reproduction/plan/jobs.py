"""Name and size of every job of a profile, from its configuration."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from reproduction.design.experiments import SHARES, split_init
from reproduction.design.files import SPLITS, Files
from reproduction.design.jobs import jobs_of_run, measurement_of

# What a frame costs whatever its resolution, and a training step whatever its images, in pixels
# (docs/cost.md).
FRAME_PX, STEP_PX = 50_000, 10_000
# Jobs of these cost the same in every profile, as do those that are done once for a run.
SCENE = ("scene", "detail", "plan", "coverage", "cell_depth", "light_shares", "cartons", "dataset")
LABELS = ("true_labels", "erroneous_labels", "posegraph", "chain")
OTHERS = ("pretrain", "varied_structure", "render_speed", "collection_speed", "table", "side_table")
ALIKE = SCENE + LABELS + OTHERS
# What jobs of a rule differ in beside their size.
VARIANTS = ("frame_method", "graph_method", "effects", "table", "model")


def jobs_of(files: Files) -> pd.DataFrame:
    """List the jobs of a full run.

    Args:
        files: Files of the profile.

    Returns:
        A row for each job: ``rule``; ``job``, its measurement below ``<root>/benchmarks`` without
        ``.tsv``; ``pace``, jobs of one pace cost the same per pixel; ``count`` of ``unit``;
        ``cost`` in pixels.
    """
    rows = []
    for rule, jobs in jobs_of_run(files).items():
        for job in jobs:
            pace = ["train" if rule == "train_varied" else rule]
            pace += [job[key] for key in VARIANTS if key in job]
            if rule == "pretrain":  # downloaded, read or trained
                pace.append(files.config.pretraining.source)
            count, unit, px = _size(files, rule, job)
            rows.append((rule, measurement_of(rule, job), " ".join(pace), count, unit, count * px))
    return pd.DataFrame(rows, columns=["rule", "job", "pace", "count", "unit", "cost"])


def _size(files: Files, rule: str, job: Mapping[str, str]) -> tuple[float, str, float]:
    """Count the items of a job; pixels that each costs. One item where all jobs are alike."""
    config, robust = files.config, files.config.robustness
    if rule in ALIKE or not (job or rule == "claims"):
        return 1.0, "", 1.0
    if "varied" in rule:
        job = {"scene": robust.scene, "size": robust.size, **job}
    if rule in ("train", "train_varied"):
        share = SHARES[split_init(job.get("init", "pretrained"))[1]]
        # Predicting costs a third of learning: one pass forward, none back.
        images = share * config.training.samples_seen[job["size"]]
        images += config.n_frames(job["scene"], job["size"], "test") / 3
        own_px = (config.network.width * config.network.input_px) ** 2
        return images, "images", own_px + STEP_PX / config.training.batch_size
    if rule == "coordinate_references":
        return float(config.coordinate_samples(job["size"])), "images", 1.0
    drawn_px, large_px = (
        camera.width * camera.height + FRAME_PX
        for camera in (config.network_camera, config.estimation_camera)
    )
    px = {
        **dict.fromkeys(("render_packed", "render_varied"), drawn_px),
        **dict.fromkeys(("pack", "pack_varied"), config.network.input_px**2),
        **dict.fromkeys(("render", "rgbd", "estimate", "features", "views"), large_px),
        "sfm": config.estimation.sfm.max_features,
    }
    return float(_frames(files, rule, job)), "frames", float(px.get(rule, 1))


def _frames(files: Files, rule: str, job: Mapping[str, str]) -> int:
    """Count the frames of a job's batch, sequence, size or scene, or those of all tests."""
    config = files.config
    splits = [job["split"]] if "split" in job else list(SPLITS)
    if "batch" in job:
        return len(files.batch(job["scene"], job["size"], job["split"], job["batch"]))
    if "sequence" in job:
        return len(files.sequence(job["scene"], job.get("camera", "network"), job["sequence"]))
    if "size" in job:
        return sum(config.n_frames(job["scene"], job["size"], split) for split in splits)
    if rule == "plan":  # one plan covers all sizes
        return sum(config.n_largest(job["scene"], split) for split in splits)
    if "scene" in job:
        return sum(files.n_frames(job["scene"], "network", split) for split in splits)
    return sum(config.n_frames(run.scene, run.size, "test") for run in files.design.runs)
