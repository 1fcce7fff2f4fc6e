"""Poses of one batch from its colour images, in metres and from the first true pose.

An SfM model has no scale and no place in the world, so two things are taken from the true poses of
the batch, as the published code does: the metric scale, from distances to the first frame, and the
pose of the first registered camera. Its full pose is used, and not a similarity fitted to the
camera centres, because the centres of a straight path leave the rotation about its line free.
Where that camera is not the batch's first, the chain counts the batch as assisted.

A wrong scale over the first frames and a first camera that few others share points with grow with
the distance, so the placed error of a long path is larger than that after a similarity fit. The
rule is kept because it is the assistance that the published labels had; what bent models, and their
first cameras with them, is removed before (``mapping.py``).
"""

from __future__ import annotations

import logging
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.costs import Facts, timed
from baselines.groundtruth.batches import (
    BatchTrajectory,
    failed_trajectory,
    link_images,
    write_trajectory,
)
from baselines.groundtruth.sfm.mapping import camera_poses, map_matches, read_matches, refine_model
from synfeal.config.models import CameraConfig, SfmConfig
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.pose_table import read_frames
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.files import write_json
from synfeal.geometry.poses import relative

log = logging.getLogger(__name__)
Array = NDArray[np.float64]


def extract_features(images: Path, database: Path, camera: CameraConfig, cfg: SfmConfig) -> None:
    """SIFT features of all images in a directory; they share one camera of known intrinsics."""
    extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    extraction.sift.max_num_features = cfg.max_features
    extraction.sift.peak_threshold = cfg.peak_threshold
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = "FULL_OPENCV" if any(camera.distortion) else "PINHOLE"
    reader.camera_params = ",".join(map(repr, colmap_parameters(camera)))
    pycolmap.extract_features(
        database,
        images,
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=reader,
        extraction_options=extraction,
        device=pycolmap.Device.cpu,
    )


def match_features(database: Path, cfg: SfmConfig, seed: int) -> None:
    """Verified matches between frames near in time; ``seed`` is that of RANSAC."""
    matching = pycolmap.FeatureMatchingOptions(
        num_threads=1, use_gpu=False, guided_matching=cfg.guided_matching
    )
    pairing = pycolmap.SequentialPairingOptions(
        overlap=cfg.overlap, quadratic_overlap=cfg.quadratic_overlap, num_threads=1
    )
    verification = pycolmap.TwoViewGeometryOptions(min_num_inliers=cfg.min_num_inliers)
    verification.ransac.random_seed = seed
    pycolmap.match_sequential(database, matching, pairing, verification, device=pycolmap.Device.cpu)


def colmap_parameters(camera: CameraConfig) -> list[float]:
    """Parameters of COLMAP's PINHOLE or, where there is distortion, FULL_OPENCV."""
    pinhole = list(camera.intrinsics)
    return [*pinhole, *camera.distortion, 0.0, 0.0, 0.0] if any(camera.distortion) else pinhole


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


def write_sfm(
    sequences: Sequence[Path],
    truth: Path,
    start: int,
    stop: int,
    camera: CameraConfig,
    sfm: SfmConfig,
    seed: int,
    out_trajectory: Path,
    out_facts: Path,
) -> None:
    """Write the trajectory of the frames ``start`` to ``stop`` of a split, and what it took."""
    color = frame_paths(sequences, "color.png")[start:stop]
    poses = read_frames(truth, start, stop).world_from_cam
    trajectory, facts = sfm_batch(color, camera, poses, sfm, seed)
    log.info(", ".join(f"{name} {value:.6g}" for name, value in facts.items()))
    write_json(out_facts, facts)
    write_trajectory(out_trajectory, trajectory)


def sfm_batch(
    color_paths: Sequence[FrameFile],  # images of the batch in order
    camera: CameraConfig,  # their camera
    # (n, 4, 4) true poses, used for scale and placement only
    true_world_from_cam: NDArray[np.float64],
    cfg: SfmConfig,  # features, matching and mapping
    seed: int,  # of RANSAC and of the mapper
) -> tuple[BatchTrajectory, Facts]:
    """Estimate the poses of one batch from its colour images.

    One thread and a fixed seed make the poses repeatable to the bit on one machine.

    Returns:
        Poses relative to the true pose of the first frame, none registered where the mapper finds
        no model or one without a scale; and how they came about: ``models`` is in how many parts
        the batch fell, of which the poses are those of one; ``explained`` the share of matched
        image points that it explained as it was mapped; ``points`` and ``reprojection_px`` are
        those of the refined model.

    Raises:
        InputError: an image does not exist, is damaged, or has another size than the camera's.
        ValueError: images and poses differ in number.
    """
    if len(color_paths) != len(true_world_from_cam):
        raise ValueError(f"{len(color_paths)} images, {len(true_world_from_cam)} poses")
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    seed %= 2**31
    pycolmap.set_random_seed(seed)
    facts: Facts = {}
    with tempfile.TemporaryDirectory(prefix="sfm-") as temporary:
        images, database = Path(temporary) / "images", Path(temporary) / "database.db"
        link_images(color_paths, camera, images)
        with timed(facts, "features_s"):
            extract_features(images, database, camera, cfg)
        with timed(facts, "matching_s"):
            match_features(database, cfg, seed)
        with timed(facts, "mapping_s"):
            matches = read_matches(images, database)
            mapping = map_matches(matches, Path(temporary) / "models", cfg, seed)
            if mapping.model is not None:
                refine_model(mapping.model)
    model = mapping.model
    trajectory = metric_trajectory(*camera_poses(model), true_world_from_cam)
    return trajectory, facts | {
        "frames": len(trajectory),
        "registered": int(trajectory.registered.sum()),
        "models": mapping.models,
        "starts": mapping.starts,
        "explained": mapping.explained,
        "points": 0 if model is None else int(model.num_points3D()),
        "reprojection_px": 0.0 if model is None else float(model.compute_mean_reprojection_error()),
    }
