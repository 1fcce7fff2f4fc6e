"""Structure from motion on one batch: the SfM row of table 2.

The paper used openMVG; here it is the incremental mapper of COLMAP on SIFT features, with
intrinsics that are known and kept fixed. An SfM model has no scale and no place in the world, so
two things are taken from the true poses of the batch, as the published code does: the metric scale,
from distances to the first frame, and the pose of the first registered camera. Its full pose is
used, and not a similarity fitted to the camera centres, because the centres of a straight path
leave the rotation about its line free.

A view of one plane has two reconstructions, and a mapper that starts from the wrong one still
registers every image. So the mapper runs from several initial images and the model that explains
the most image points is taken: in the wrong ones, points leave the reprojection threshold and are
dropped.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.groundtruth.trajectory import BatchTrajectory, failed_trajectory
from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.models import CameraConfig, SfmConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_matrix, relative

Array = NDArray[np.float64]

# The published code's rule for the scale: the first 44 frames, none nearer than 5 cm to the first.
_SCALE_FRAMES = 44
_SCALE_MIN_M = 0.05

# Rendered images have exact intrinsics and no blur: half of COLMAP's thresholds for photographs.
_MAX_ERROR_PX = 2.0

# Where in the batch the mapper starts, as a share of its length; None leaves the choice to it.
_STARTS = (None, 0.25, 0.5, 0.75)


def sfm_batch(
    color_paths: Sequence[Path],
    camera: CameraConfig,
    true_world_from_cam: Array,
    cfg: SfmConfig,
    seed: int,
    work_dir: Path,
) -> BatchTrajectory:
    """Estimate the poses of one batch from its colour images.

    One thread and a fixed seed make the result repeatable on one machine.

    Args:
        color_paths: images of the batch in order.
        camera: their camera.
        true_world_from_cam: (n, 4, 4) true poses, used for scale and placement only.
        cfg: features, matching and triangulation.
        seed: of RANSAC.
        work_dir: an existing directory for temporary files.

    Returns:
        Poses relative to the true pose of the first frame. No frame is registered where the mapper
        finds no model, or one from which no scale can be read.

    Raises:
        InputError: an image does not exist.
        ValueError: images and poses differ in number.
    """
    if len(color_paths) != len(true_world_from_cam):
        raise ValueError(f"{len(color_paths)} images, {len(true_world_from_cam)} poses")
    with tempfile.TemporaryDirectory(prefix="sfm-", dir=work_dir) as temporary:
        model = _best_model(color_paths, camera, cfg, seed % 2**31, Path(temporary))
    return _metric_trajectory(*model, true_world_from_cam)


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


def _metric_trajectory(
    frames: NDArray[np.int64], model_from_cam: Array, true_world_from_cam: Array
) -> BatchTrajectory:
    """Scale a model of some ``frames`` (m,), poses (m, 4, 4), and place its first camera."""
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


def _best_model(
    color_paths: Sequence[Path], camera: CameraConfig, cfg: SfmConfig, seed: int, work_dir: Path
) -> tuple[NDArray[np.int64], Array]:
    """Registered frames (m,) in order and their ``model_from_cam`` (m, 4, 4); m = 0 on failure."""
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    pycolmap.set_random_seed(seed)
    images, database = work_dir / "images", work_dir / "database.db"
    _link_images(color_paths, images)
    _match(images, database, camera, cfg, seed)
    models = _models(images, database, work_dir / "models", cfg, seed)
    if not models:
        return np.empty(0, dtype=np.int64), np.empty((0, 4, 4))
    model = max(models, key=lambda model: int(model.compute_num_observations()))
    found = {
        int(Path(image.name).stem): image.cam_from_world().matrix()
        for image in model.images.values()
        if image.has_pose
    }
    frames = np.array(sorted(found), dtype=np.int64)
    cam_from_model = np.array([found[frame] for frame in frames])
    return frames, inverse(pose_matrix(cam_from_model[:, :, :3], cam_from_model[:, :, 3]))


def _models(
    images: Path, database: Path, work_dir: Path, cfg: SfmConfig, seed: int
) -> list[pycolmap.Reconstruction]:
    """All models from all starts."""
    work_dir.mkdir()
    with pycolmap.Database.open(database) as opened:
        ids = [image.image_id for image in sorted(opened.read_all_images(), key=lambda i: i.name)]
    models: list[pycolmap.Reconstruction] = []
    for start in _STARTS:
        options = _mapping_options(cfg, seed)
        if start is not None:
            options.init_image_id1 = ids[int(start * len(ids))]
        models += pycolmap.incremental_mapping(database, images, work_dir, options).values()
    return models


def _link_images(color_paths: Sequence[Path], images: Path) -> None:
    """One directory in which the order of the names is the order of the frames."""
    images.mkdir()
    for frame, path in enumerate(color_paths):
        if not path.is_file():
            raise InputError(f"{path}: no such image; collect the data set again")
        (images / f"{frame:06d}{path.suffix}").symlink_to(path.resolve())


def _match(images: Path, database: Path, camera: CameraConfig, cfg: SfmConfig, seed: int) -> None:
    """Features of all images and verified matches between neighbours in time."""
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = "PINHOLE"
    reader.camera_params = ",".join(map(repr, intrinsics_of(camera)))
    extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    extraction.sift.max_num_features = cfg.max_features
    pycolmap.extract_features(
        database,
        images,
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=reader,
        extraction_options=extraction,
        device=pycolmap.Device.cpu,
    )
    matching = pycolmap.FeatureMatchingOptions(num_threads=1, use_gpu=False)
    pairing = pycolmap.SequentialPairingOptions(
        overlap=cfg.overlap, quadratic_overlap=False, num_threads=1
    )
    verification = pycolmap.TwoViewGeometryOptions(min_num_inliers=cfg.min_num_inliers)
    verification.ransac.random_seed = seed
    pycolmap.match_sequential(database, matching, pairing, verification, device=pycolmap.Device.cpu)


def _mapping_options(cfg: SfmConfig, seed: int) -> pycolmap.IncrementalPipelineOptions:
    """Known intrinsics kept everywhere; thresholds lowered for short baselines."""
    options = pycolmap.IncrementalPipelineOptions(
        num_threads=1,
        random_seed=seed,
        min_num_matches=cfg.min_num_inliers,
        min_model_size=2,
        max_num_models=2,
        extract_colors=False,
        ba_refine_focal_length=False,
        ba_refine_principal_point=False,
        ba_refine_extra_params=False,
        ba_global_frames_ratio=1.3,
        ba_global_points_ratio=1.3,
    )
    options.mapper.random_seed = seed
    options.mapper.num_threads = 1
    options.mapper.abs_pose_refine_focal_length = False
    options.mapper.abs_pose_refine_extra_params = False
    options.mapper.init_max_error = _MAX_ERROR_PX
    options.mapper.abs_pose_max_error = 2 * _MAX_ERROR_PX
    options.mapper.filter_max_reproj_error = _MAX_ERROR_PX
    options.mapper.init_min_num_inliers = 2 * cfg.min_num_inliers
    options.mapper.init_min_tri_angle = cfg.init_min_tri_angle_deg
    options.mapper.abs_pose_min_num_inliers = cfg.min_num_inliers
    options.triangulation.complete_max_reproj_error = _MAX_ERROR_PX
    options.triangulation.merge_max_reproj_error = _MAX_ERROR_PX
    options.triangulation.random_seed = seed
    return options
