"""Mapping of a batch from its matches, and the choice of a model.

A view of one plane has two reconstructions, and a mapper that starts from the wrong one still
registers every image. In the wrong one points leave the reprojection threshold and are dropped. So
a model is judged by the share of the matched image points that it explains, which images that are
matched and not registered lower too. A model that explains too little is doubtful: the mapper
starts again from another image, and the model that explains the most is taken. A long path that
bends only near its end is not noticed: it still explains most points.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.config.labels import SfmConfig
from synfeal.geometry.poses import inverse, pose_matrix

_LOG = logging.getLogger(__name__)

# Where in the batch the mapper starts, as a share of its length; None leaves the choice to it.
_STARTS = (None, 0.5, 0.25, 0.75)


@dataclass(frozen=True)
class Matches:
    """Verified matches of a batch, the input of both mappers.

    Attributes:
        images: Directory of the images.
        database: Their features and verified matches.
        image_ids: Identifiers in the order of the frames.
        matched_points: Image points with at least one verified match.
    """

    images: Path
    database: Path
    image_ids: tuple[int, ...]
    matched_points: int


@dataclass(frozen=True)
class Mapping:
    """Result of mapping a batch.

    Attributes:
        model: The one that explains the most; None when there is none.
        models: Number of models: the parts that the batch fell into.
        starts: Number of times that the mapper started.
        explained: Share of the matched image points that ``model`` explains.
    """

    model: pycolmap.Reconstruction | None
    models: int
    starts: int
    explained: float


def read_matches(images: Path, database: Path) -> Matches:
    """Read the matches of the images in a directory, from their database."""
    with pycolmap.Database.open(database) as opened:
        ids = [image.image_id for image in sorted(opened.read_all_images(), key=lambda i: i.name)]
        cache = pycolmap.DatabaseCache.create(opened, pycolmap.DatabaseCacheOptions())
    graph = cache.correspondence_graph
    points = sum(graph.num_observations_for_image(i) for i in ids if graph.exists_image(i))
    return Matches(images, database, tuple(ids), points)


def map_matches(matches: Matches, work_dir: Path, cfg: SfmConfig, seed: int) -> Mapping:
    """Map a batch, and choose its best model.

    Args:
        matches: Verified matches of the batch.
        work_dir: Directory to create, for the mapper's own files.
        cfg: Settings; ``cfg.mapper`` says whether to map incrementally or globally.
        seed: Seed of the mapper.

    Returns:
        The mapping, without a model where there are no matches or the mapper finds none.
    """
    work_dir.mkdir()
    if not matches.matched_points:
        return Mapping(None, 0, 0, 0.0)
    if cfg.mapper == "global":
        models = pycolmap.global_mapping(
            matches.database, matches.images, work_dir, global_options(cfg, seed)
        )
        return _mapping(models.values(), matches)
    return _best_start(matches, work_dir, cfg, seed)


def camera_poses(
    model: pycolmap.Reconstruction | None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return registered frames (m,) and their ``model_from_cam`` (m, 4, 4); m = 0 without model."""
    images = [] if model is None else [i for i in model.images.values() if i.has_pose]
    images.sort(key=lambda image: str(image.name))
    frames = np.array([int(Path(image.name).stem) for image in images], dtype=np.int64)
    cam_from_model = [image.cam_from_world().matrix() for image in images]
    matrices = np.array(cam_from_model, dtype=np.float64).reshape(-1, 3, 4)
    return frames, inverse(pose_matrix(matrices[:, :, :3], matrices[:, :, 3]))


def _best_start(matches: Matches, work_dir: Path, cfg: SfmConfig, seed: int) -> Mapping:
    """Map from several starts until one explains enough; return that model, or the best one."""
    deadline = time.monotonic() + cfg.max_mapping_s
    best = Mapping(None, 0, 0, 0.0)
    for starts, start in enumerate(_STARTS, start=1):
        left_s = math.floor(deadline - time.monotonic())
        if left_s < 1:
            _LOG.warning("mapping stopped after max_mapping_s = %d s", cfg.max_mapping_s)
            break
        options = incremental_options(cfg, seed, left_s)
        if start is not None:
            options.init_image_id1 = matches.image_ids[int(start * len(matches.image_ids))]
        models = pycolmap.incremental_mapping(matches.database, matches.images, work_dir, options)
        found = _mapping(models.values(), matches)
        best = replace(max(best, found, key=lambda mapping: mapping.explained), starts=starts)
        if best.explained >= cfg.min_explained:
            break
    return best


def _mapping(models: Iterable[pycolmap.Reconstruction], matches: Matches) -> Mapping:
    """Choose the model with the most observations among those of one start."""
    by_observations = sorted(models, key=lambda model: int(model.compute_num_observations()))
    if not by_observations:
        return Mapping(None, 0, 1, 0.0)
    model = by_observations[-1]
    explained = int(model.compute_num_observations()) / matches.matched_points
    return Mapping(model, len(by_observations), 1, explained)


# Rendered images have exact intrinsics and no blur: half of COLMAP's thresholds for photographs.
_MAX_ERROR_PX = 2.0

# Bundle adjustment of neighbours follows every image, and the global one corrects what it leaves.
# COLMAP's tolerances of zero spend half of the time on digits that the next image changes: a
# model that came out bent was bent with them too, and adjusting finished models to convergence left
# their errors as they were.
_LOCAL_STEPS, _LOCAL_TOLERANCE = 10, 1e-4
_GLOBAL_STEPS, _GLOBAL_TOLERANCE = 20, 1e-6
_GLOBAL_GROWTH = 1.3  # the global one is due when images or points have grown by this factor

_MAX_MODELS = 5  # pieces that a batch may fall into, from one start


def incremental_options(
    cfg: SfmConfig, seed: int, max_seconds: int
) -> pycolmap.IncrementalPipelineOptions:
    """Return the options of the incremental mapper.

    Args:
        cfg: Least inliers of a pair, and least triangulation angle of the first.
        seed: Seed of the mapper.
        max_seconds: Time after which the mapper stops with what it has.
    """
    options = pycolmap.IncrementalPipelineOptions(
        num_threads=1,
        random_seed=seed,
        min_num_matches=cfg.min_num_inliers,
        min_model_size=2,
        max_num_models=_MAX_MODELS,
        max_runtime_seconds=max_seconds,
        extract_colors=False,
        ba_refine_focal_length=False,
        ba_refine_principal_point=False,
        ba_refine_extra_params=False,
        ba_local_max_num_iterations=_LOCAL_STEPS,
        ba_local_function_tolerance=_LOCAL_TOLERANCE,
        ba_local_max_refinements=1,
        ba_global_frames_ratio=_GLOBAL_GROWTH,
        ba_global_points_ratio=_GLOBAL_GROWTH,
        ba_global_max_num_iterations=_GLOBAL_STEPS,
        ba_global_function_tolerance=_GLOBAL_TOLERANCE,
        ba_global_max_refinements=2,
    )
    _set_mapper(options.mapper, cfg, seed)
    _set_triangulation(options.triangulation, seed)
    return options


def global_options(cfg: SfmConfig, seed: int) -> pycolmap.GlobalPipelineOptions:
    """Return options of the global mapper: all rotations, then all positions, then adjustment."""
    options = pycolmap.GlobalPipelineOptions(
        num_threads=1, random_seed=seed, min_num_matches=cfg.min_num_inliers, min_model_size=2
    )
    mapper = options.mapper
    mapper.num_threads = 1
    mapper.bundle_adjustment.ceres.solver_options.num_threads = 1
    for stage in (mapper, mapper.rotation_averaging, mapper.global_positioning):
        stage.random_seed = seed
    mapper.global_positioning.use_gpu = False
    mapper.bundle_adjustment.ceres.use_gpu = False
    mapper.bundle_adjustment.refine_focal_length = False
    mapper.bundle_adjustment.refine_extra_params = False
    _set_triangulation(mapper.retriangulation, seed)
    return options


def _set_mapper(options: pycolmap.IncrementalMapperOptions, cfg: SfmConfig, seed: int) -> None:
    options.random_seed = seed
    options.num_threads = 1
    options.abs_pose_refine_focal_length = False
    options.abs_pose_refine_extra_params = False
    options.abs_pose_max_error = 2 * _MAX_ERROR_PX
    options.abs_pose_min_num_inliers = cfg.min_num_inliers
    options.filter_max_reproj_error = _MAX_ERROR_PX
    options.init_max_error = _MAX_ERROR_PX
    options.init_min_num_inliers = 2 * cfg.min_num_inliers
    options.init_min_tri_angle = cfg.init_min_tri_angle_deg


def _set_triangulation(options: pycolmap.IncrementalTriangulatorOptions, seed: int) -> None:
    options.random_seed = seed
    options.complete_max_reproj_error = _MAX_ERROR_PX
    options.merge_max_reproj_error = _MAX_ERROR_PX


# Steps at the most, and the tolerance: one a hundred times as small takes a fifth longer and gains
# a tenth of a millimetre.
_STEPS, _TOLERANCE = 20, 1e-4


def refine_model(model: pycolmap.Reconstruction) -> None:
    """Adjust a model in place, so that observations far off lose their say.

    The mapper minimises squares, in which a few mismatches that move alike from frame to frame
    outweigh thousands of good observations and bend the model. Here an observation counts by
    Cauchy's loss. Its scale is the median error, so it fits rendered images and photographs alike.
    """
    model.update_point_3d_errors()
    errors_px = [point.error for point in model.points3D.values()]
    if not errors_px:
        return
    config, options = adjustment_of(model, _STEPS)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    options.ceres.solver_options.function_tolerance = _TOLERANCE
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = float(np.median(errors_px))
    pycolmap.create_default_bundle_adjuster(options, config, model).solve()


def adjustment_of(
    model: pycolmap.Reconstruction, steps: int
) -> tuple[pycolmap.BundleAdjustmentConfig, pycolmap.BundleAdjustmentOptions]:
    """Prepare the adjustment of all poses and points of a model; one thread makes it repeatable.

    Args:
        model: Model to adjust; its camera stays as it is.
        steps: Most iterations of the solver.
    """
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in model.reg_image_ids():
        config.add_image(image_id)
    options = pycolmap.BundleAdjustmentOptions(
        refine_focal_length=False,
        refine_principal_point=False,
        refine_extra_params=False,
        print_summary=False,
    )
    options.ceres.use_gpu = False
    options.ceres.solver_options.num_threads = 1
    options.ceres.solver_options.max_num_iterations = steps
    return config, options
