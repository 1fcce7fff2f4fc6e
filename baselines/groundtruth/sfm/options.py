"""Settings of COLMAP's two mappers: known intrinsics, one thread, low thresholds."""

from __future__ import annotations

import pycolmap

from synfeal.config.models import SfmConfig

# Rendered images have exact intrinsics and no blur: half of COLMAP's thresholds for photographs.
_MAX_ERROR_PX = 2.0

# Bundle adjustment of neighbours follows every image, and the global one corrects what it leaves.
# COLMAP's tolerances of zero spend half of the time on digits that the next image changes: a
# model that came out bent was bent with them too, and adjusting finished models to convergence left
# their errors as they were.
_LOCAL_STEPS, _LOCAL_TOLERANCE = 10, 1e-4
_GLOBAL_STEPS, _GLOBAL_TOLERANCE = 20, 1e-6
_GLOBAL_GROWTH = 1.3  # the global one is due when images or points have grown by this factor

_MAX_MODELS = 5  # of one start, where the batch falls into pieces


def incremental_options(
    cfg: SfmConfig, seed: int, max_seconds: int
) -> pycolmap.IncrementalPipelineOptions:
    """Options of the incremental mapper, which stops after ``max_seconds``."""
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
    """Options of the global mapper: all rotations at once, then all positions, then adjustment."""
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
