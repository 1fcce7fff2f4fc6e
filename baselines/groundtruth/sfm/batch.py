"""Poses of one batch from its colour images, in metres and from the first true pose.

An SfM model has no scale and no place in the world, so two things are taken from the true poses of
the batch, as the published code does: the metric scale, from distances to the first frame, and the
pose of the first registered camera. Its full pose is used, and not a similarity fitted to the
camera centres, because the centres of a straight path leave the rotation about its line free.
Where that camera is not the batch's first, the chain counts the batch as assisted.

A wrong scale over the first frames and a first camera that few others share points with grow with
the distance, so the placed error of a long path is larger than that after a similarity fit
(``results/benchmarks/sfm_settings.csv``). The rule is kept because it is the assistance that the
published labels had; what bent models, and their first cameras with them, is removed before
(``refine.py``).
"""

from __future__ import annotations

import math
import resource
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.groundtruth.images import link_images
from baselines.groundtruth.sfm.features import extract_features, match_features
from baselines.groundtruth.sfm.mapping import Mapping, camera_poses, map_matches, read_matches
from baselines.groundtruth.sfm.refine import refine_model
from baselines.groundtruth.trajectory import BatchTrajectory, failed_trajectory
from synfeal.config.models import CameraConfig, SfmConfig
from synfeal.dataset.archive import FrameFile
from synfeal.geometry.poses import relative

Array = NDArray[np.float64]

# The published code's rule for the scale: the first 44 frames, none nearer than 5 cm to the first.
_SCALE_FRAMES = 44
_SCALE_MIN_M = 0.05


def metric_scale(true_position_m: Array, position: Array) -> float:
    """Metres per unit of the model, from camera centres (n, 3) of the same frames.

    The published code takes the mean ratio of true to estimated distances from the first frame over
    its first 44 frames, leaving out those under 5 cm; the median is as simple and bears a wrong
    pose. NaN when no frame is left.
    """
    true_m = np.linalg.norm(true_position_m[:_SCALE_FRAMES] - true_position_m[0], axis=1)
    distance = np.linalg.norm(position[:_SCALE_FRAMES] - position[0], axis=1)
    usable = (true_m >= _SCALE_MIN_M) & (distance > 0)
    return float(np.median(true_m[usable] / distance[usable])) if usable.any() else math.nan


def metric_trajectory(
    frames: NDArray[np.int64], model_from_cam: Array, true_world_from_cam: Array
) -> BatchTrajectory:
    """Scale a model of some ``frames`` (m,), poses (m, 4, 4), and place its first camera.

    No frame is registered where there are fewer than two, or none to read a scale from.
    """
    trajectory = failed_trajectory(len(true_world_from_cam))
    if len(frames) < 2:
        return trajectory
    true = true_world_from_cam[frames]
    scale = metric_scale(true[:, :3, 3], model_from_cam[:, :3, 3])
    if not math.isfinite(scale):
        return trajectory
    motion = relative(model_from_cam[0], model_from_cam)
    motion[:, :3, 3] *= scale
    trajectory.first_from_cam[frames] = relative(true_world_from_cam[0], true[0]) @ motion
    trajectory.registered[frames] = True
    return trajectory


@dataclass(frozen=True)
class SfmFacts:
    """How a batch was reconstructed.

    Attributes:
        frames: of the batch.
        registered: frames with a pose.
        models: parts that the batch fell into; the poses are those of one of them.
        starts: how often the mapper started.
        explained: share of the matched image points that the model explained as it was mapped.
        points: 3D points of the refined model.
        reprojection_px: mean distance of image points from the projections of their 3D points.
        features_s: CPU seconds spent on finding features.
        matching_s: CPU seconds spent on matching them.
        mapping_s: CPU seconds spent on building models and refining one.
        peak_memory_mb: most memory the process has held so far.
    """

    frames: int
    registered: int
    models: int
    starts: int
    explained: float
    points: int
    reprojection_px: float
    features_s: float
    matching_s: float
    mapping_s: float
    peak_memory_mb: float

    def to_json(self) -> dict[str, float]:
        """Names and values."""
        return asdict(self)

    def __str__(self) -> str:
        """One line for a log."""
        return ", ".join(f"{name} {value:.6g}" for name, value in asdict(self).items())


@dataclass(frozen=True)
class SfmEstimate:
    """Poses relative to the true pose of the first frame, and how they came about."""

    trajectory: BatchTrajectory
    facts: SfmFacts


def sfm_batch(
    color_paths: Sequence[FrameFile],
    camera: CameraConfig,
    true_world_from_cam: NDArray[np.float64],
    cfg: SfmConfig,
    seed: int,
    work_dir: Path,
) -> SfmEstimate:
    """Estimate the poses of one batch from its colour images.

    One thread and a fixed seed make the poses repeatable to the bit on one machine.

    Args:
        color_paths: images of the batch in order.
        camera: their camera.
        true_world_from_cam: (n, 4, 4) true poses, used for scale and placement only.
        cfg: features, matching and mapping.
        seed: of RANSAC and of the mapper.
        work_dir: an existing directory for temporary files.

    Returns:
        The estimate. No frame is registered where the mapper finds no model, or one from which no
        scale can be read.

    Raises:
        InputError: an image does not exist, is damaged, or has another size than the camera's.
        ValueError: images and poses differ in number.
    """
    if len(color_paths) != len(true_world_from_cam):
        raise ValueError(f"{len(color_paths)} images, {len(true_world_from_cam)} poses")
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    seed %= 2**31
    pycolmap.set_random_seed(seed)
    with tempfile.TemporaryDirectory(prefix="sfm-", dir=work_dir) as temporary:
        images, database = Path(temporary) / "images", Path(temporary) / "database.db"
        link_images(color_paths, camera, images)
        seconds = [
            cpu_s(lambda: extract_features(images, database, camera, cfg)),
            cpu_s(lambda: match_features(database, cfg, seed)),
        ]
        begin = time.process_time()
        matches = read_matches(images, database)
        mapping = map_matches(matches, Path(temporary) / "models", cfg, seed)
        if mapping.model is not None:
            refine_model(mapping.model)
        seconds.append(time.process_time() - begin)
    trajectory = metric_trajectory(*camera_poses(mapping.model), true_world_from_cam)
    return SfmEstimate(trajectory, _facts(trajectory, mapping, seconds))


def cpu_s(work: Callable[[], None]) -> float:
    """CPU seconds of a piece of work."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def _facts(trajectory: BatchTrajectory, mapping: Mapping, seconds: Sequence[float]) -> SfmFacts:
    model = mapping.model
    features_s, matching_s, mapping_s = seconds
    return SfmFacts(
        frames=len(trajectory),
        registered=int(trajectory.registered.sum()),
        models=mapping.models,
        starts=mapping.starts,
        explained=mapping.explained,
        points=0 if model is None else int(model.num_points3D()),
        reprojection_px=0.0 if model is None else float(model.compute_mean_reprojection_error()),
        features_s=features_s,
        matching_s=matching_s,
        mapping_s=mapping_s,
        peak_memory_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    )
