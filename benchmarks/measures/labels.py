"""Estimated poses of one batch: how far they are from the true ones, and what they took."""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from baselines.config.labels import EstimationConfig
from baselines.labels.chain import fill_gaps
from baselines.labels.kinect_fusion import kinect_fusion_batch
from baselines.labels.posegraph.levenberg_marquardt import optimise_lm
from baselines.labels.rgbd import rgbd_graph
from baselines.labels.sfm import sfm_batch
from synfeal.config.dataset import CameraConfig
from synfeal.config.types import Strict
from synfeal.dataset.sevenscenes import read_pose
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, relative
from synfeal.records.provenance import seed_of

Array = NDArray[np.float64]


class BatchCase(Strict):
    """A batch of a 7-Scenes sequence and the settings that estimate its poses."""

    sequence: Path = Field(description="directory of frame-XXXXXX.{color.png,depth.png,pose.txt}")
    start: int = Field(0, description="first frame")
    every: int = Field(
        1, description="frames of the sequence from one frame of the batch to the next"
    )
    length: int = Field(251, description="frames of the batch")
    estimation_camera: CameraConfig = Field(description="camera of the frames")
    estimation: EstimationConfig = Field(description="settings of the methods")


class BatchFiles(NamedTuple):
    """Files of a batch, and the true poses (N, 4, 4)."""

    color: list[Path]
    depth: list[Path]
    world_from_cam: Array


def run_sfm(case: BatchCase, seed: int) -> dict[str, float]:
    """Measure the errors of all frames when the batch starts at its true first pose, gaps filled.

    Raises:
        InputError: the frames cannot be used.
    """
    batch = open_batch(case)
    trajectory, facts = sfm_batch(
        batch.color,
        case.estimation_camera,
        batch.world_from_cam,
        case.estimation.sfm,
        seed_of(seed, "sfm"),
    )
    return {
        **facts,
        **errors("sfm", fill_gaps(trajectory), batch.world_from_cam),
        "cpu_s": facts["features_s"] + facts["matching_s"] + facts["mapping_s"],
    }


def run_rgbd(case: BatchCase, seed: int) -> dict[str, float]:
    """Measure the errors of the odometry, and of the graph as Levenberg-Marquardt leaves it.

    Raises:
        InputError: the frames cannot be used.
    """
    batch, cfg = open_batch(case), case.estimation
    graph, facts = rgbd_graph(
        batch.color, batch.depth, case.estimation_camera, cfg.rgbd, seed_of(seed, "rgbd")
    )
    begin_s = time.process_time()
    optimised = optimise_lm(graph, cfg.posegraph.lm_iterations)
    optimise_s = time.process_time() - begin_s
    return {
        "pairs_accepted": facts["pairs_accepted"],
        "loops": facts["loops"],
        **errors("odometry", graph.first_from_cam, batch.world_from_cam),
        **errors("g2o", optimised, batch.world_from_cam),
        "cpu_s": facts["odometry_s"] + facts["loops_s"] + optimise_s,
    }


def run_kinect_fusion(case: BatchCase, seed: int) -> dict[str, float]:
    """Count the frames lost, and measure the errors of the others, the first pose given.

    Raises:
        InputError: the frames cannot be used.
    """
    batch, cfg, camera = open_batch(case), case.estimation.kinect_fusion, case.estimation_camera
    # Two frames compile the registration, which is not what is timed.
    kinect_fusion_batch(batch.color[:2], batch.depth[:2], camera, cfg)
    begin_s = time.process_time()
    sensor = seed_of(seed, "kinect-fusion")
    tracked = kinect_fusion_batch(batch.color, batch.depth, camera, cfg, sensor)
    cpu_s = time.process_time() - begin_s
    found = tracked.registered
    return {
        "lost": int((~found).sum()),
        **errors("found", tracked.first_from_cam[found], batch.world_from_cam[found]),
        "s_per_frame": cpu_s / len(found),
    }


def open_batch(case: BatchCase) -> BatchFiles:
    """Open the frames of a case.

    Raises:
        InputError: the sequence is shorter.
    """
    numbers = range(case.start, case.start + case.every * case.length, case.every)
    color, depth, poses = (
        [case.sequence / f"frame-{number:06d}.{kind}" for number in numbers]
        for kind in ("color.png", "depth.png", "pose.txt")
    )
    if not poses[-1].exists():
        raise InputError(
            poses[-1], "is missing", "give a longer sequence, or lower start or length"
        )
    return BatchFiles(color, depth, np.array([read_pose(path) for path in poses]))


def errors(name: str, first_from_cam: Array, world_from_cam: Array) -> dict[str, float]:
    """Compute the median, largest and last error of the poses of a batch.

    Args:
        name: What the names of the values begin with.
        first_from_cam: Estimated poses (N, 4, 4), relative to the first.
        world_from_cam: True poses (N, 4, 4).

    Returns:
        Errors in metres and degrees, by name.
    """
    true = relative(world_from_cam[0], world_from_cam)
    error_m, error_rad = pose_error(first_from_cam, true)
    measured = {}
    for unit, values in (("m", error_m), ("deg", np.degrees(error_rad))):
        measured[f"{name}_median_{unit}"] = float(np.median(values))
        measured[f"{name}_max_{unit}"] = float(values.max())
        measured[f"{name}_last_{unit}"] = float(values[-1])
    return measured
