"""Poses of one batch from its colour images."""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.groundtruth.sfm.features import extract_features, match_features
from baselines.groundtruth.sfm.images import link_images
from baselines.groundtruth.sfm.mapping import Mapping, camera_poses, map_matches, read_matches
from baselines.groundtruth.sfm.refine import refine_model
from baselines.groundtruth.sfm.scale import metric_trajectory
from baselines.groundtruth.trajectory import BatchTrajectory
from synfeal.config.models import CameraConfig, SfmConfig
from synfeal.dataset.archive import FrameFile


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
