"""Poses of one batch from its colour images, scaled and placed by true poses.

Images are matched with those near in time and with those of other paths that look like them
(``pairs.py``); features are weaker where there are few (``features.py``). A model has no scale and
no place in the world: both are taken from true poses (``gauge.py``). Where the first registered
camera is not the batch's first, the chain counts the batch as assisted.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.config.labels import SfmConfig
from baselines.labels.batches import (
    BatchTrajectory,
    failed_trajectory,
    link_images,
    write_trajectory,
)
from baselines.labels.sfm.features import extract_features
from baselines.labels.sfm.gauge import Gauge, placed
from baselines.labels.sfm.mapping import camera_poses, map_matches, read_matches, refine_model
from baselines.labels.sfm.pairs import (
    match_retrieved,
    matching_options,
    retrieved_pairs,
    thumbnails,
    verification_options,
)
from baselines.registry.kinds import LabelMethod
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.pose_table import read_frames
from synfeal.dataset.sevenscenes import frames_between
from synfeal.geometry.poses import relative
from synfeal.records.files import write_json
from synfeal.records.timing import Facts, timed

log = logging.getLogger(__name__)
Array = NDArray[np.float64]


def match_features(database: Path, cfg: SfmConfig, seed: int) -> None:
    """Match frames that are near in time, and write the verified matches to the database.

    Args:
        database: COLMAP database that holds the features of all images.
        cfg: Matching and verification; ``overlap`` and ``quadratic_overlap`` say which frames.
        seed: Seed of RANSAC.
    """
    pairing = pycolmap.SequentialPairingOptions(
        overlap=cfg.overlap, quadratic_overlap=cfg.quadratic_overlap, num_threads=1
    )
    pycolmap.match_sequential(
        database,
        matching_options(cfg),
        pairing,
        verification_options(cfg, seed),
        device=pycolmap.Device.cpu,
    )


def metric_trajectory(
    frames: NDArray[np.int64],
    model_from_cam: Array,
    true_world_from_cam: Array,
    gauge: Gauge = "first_poses",
) -> BatchTrajectory:
    """Scale and place a model by true poses.

    Args:
        frames: Frames (m,) of the batch that the model registers.
        model_from_cam: Their poses (m, 4, 4) in the model.
        true_world_from_cam: True poses (n, 4, 4) of all frames of the batch.
        gauge: Which true poses place and scale the model.

    Returns:
        The trajectory. No frame is registered where there are fewer than two, or none to read a
        scale from.
    """
    trajectory = failed_trajectory(len(true_world_from_cam))
    world_from_cam = placed(model_from_cam, true_world_from_cam[frames], gauge)
    if world_from_cam is not None:
        trajectory.first_from_cam[frames] = relative(true_world_from_cam[0], world_from_cam)
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
    """Estimate the poses of one batch by structure from motion, and write its trajectory.

    Args:
        sequences: Sequences of the split with colour, from its first one.
        truth: Pose table of the split's true poses, which place and scale the model.
        start: First frame of the batch, counted from 0 in the split.
        stop: One past its last frame.
        camera: Camera of the images.
        sfm: Features, matching and mapping.
        seed: Seed of RANSAC and of the mapper.
        out_trajectory: CSV to write.
        out_facts: JSON to write: what it took and how the model came about; see :func:`sfm_batch`.

    Raises:
        InputError: an image or the true poses cannot be read, or an image has another size than the
            camera.
    """
    color = frames_between(sequences, "color.png", start, stop)
    poses = read_frames(truth, start, stop).world_from_cam
    trajectory, facts = sfm_batch(color, camera, poses, sfm, seed)
    log.info(", ".join(f"{name} {value:.6g}" for name, value in facts.items()))
    write_json(out_facts, facts)
    write_trajectory(out_trajectory, trajectory)


@LabelMethod(name="sfm", title="SfM", rank=1, works_on="rule", published_assisted=3)
def sfm_batch(
    color_paths: Sequence[FrameFile],
    camera: CameraConfig,
    true_world_from_cam: NDArray[np.float64],
    cfg: SfmConfig,
    seed: int,
) -> tuple[BatchTrajectory, Facts]:
    """Estimate the poses of one batch from its colour images.

    One thread and a fixed seed make the poses repeatable to the bit on one machine.

    Args:
        color_paths: Images of the batch in order.
        camera: Their camera.
        true_world_from_cam: True poses (n, 4, 4), used for scale and placement only.
        cfg: Features, matching and mapping.
        seed: Seed of RANSAC and of the mapper.

    Returns:
        Poses relative to the true pose of the first frame, none registered where the mapper finds
        no model or one without a scale; and how they came about: ``models`` is in how many parts
        the batch fell, of which the poses are those of one; ``explained`` the share of matched
        image points that it explained as it was mapped; ``points`` and ``reprojection_px`` are
        those of the refined model; ``images_with_weak_features`` had few of the usual ones, and
        ``retrieved_pairs`` were matched beside neighbours in time.

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
            n_poor = extract_features(images, database, camera, cfg)
        with timed(facts, "matching_s"):
            match_features(database, cfg, seed)
            pairs = retrieved_pairs(thumbnails(color_paths, camera), cfg.retrieved)
            match_retrieved(
                database, sorted(path.name for path in images.iterdir()), pairs, cfg, seed
            )
        with timed(facts, "mapping_s"):
            matches = read_matches(images, database)
            mapping = map_matches(matches, Path(temporary) / "models", cfg, seed)
            if mapping.model is not None:
                refine_model(mapping.model)
    model = mapping.model
    frames, model_from_cam = camera_poses(model)
    trajectory = metric_trajectory(frames, model_from_cam, true_world_from_cam, cfg.gauge)
    return trajectory, facts | {
        "frames": len(trajectory),
        "registered": int(trajectory.registered.sum()),
        "images_with_weak_features": n_poor,
        "retrieved_pairs": len(pairs),
        "models": mapping.models,
        "starts": mapping.starts,
        "explained": mapping.explained,
        "points": 0 if model is None else int(model.num_points3D()),
        "reprojection_px": 0.0 if model is None else float(model.compute_mean_reprojection_error()),
    }
