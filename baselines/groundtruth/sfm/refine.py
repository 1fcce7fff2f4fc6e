"""The model of a batch without the observations that bend it.

The mapper keeps image points up to 2 px off, for a model that still grows may lean. In rendered
images features are exact to about a tenth of a pixel: what is further off is a mismatch, and a few
in a hundred, wrong in the same way from frame to frame, turn the path as it goes on. They are left
out with limits that become narrower, and the model is adjusted to the rest.
"""

from __future__ import annotations

import numpy as np
import pycolmap

# Limits of reprojection errors, one after the other; 3 to 5 times what is usual in rendered images.
_MAX_ERRORS_PX = (0.5, 0.3)
# A limit is passed over when the median error exceeds this share of it: the images are not exact.
_USUAL_SHARE = 0.7
_MIN_TRI_ANGLE_DEG = 1.0
_STEPS, _TOLERANCE = 20, 1e-7


def refine_model(model: pycolmap.Reconstruction) -> None:
    """Drop observations that are too far off and adjust the model to the others, in place."""
    for limit_px in _MAX_ERRORS_PX:
        model.update_point_3d_errors()
        errors_px = [point.error for point in model.points3D.values()]
        if not errors_px or np.median(errors_px) > _USUAL_SHARE * limit_px:
            return
        pycolmap.ObservationManager(model).filter_all_points3D(limit_px, _MIN_TRI_ANGLE_DEG)
        _adjust(model)


def adjustment_of(
    model: pycolmap.Reconstruction, steps: int
) -> tuple[pycolmap.BundleAdjustmentConfig, pycolmap.BundleAdjustmentOptions]:
    """Adjustment of all poses and points; intrinsics are known, one thread makes it repeatable."""
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


def _adjust(model: pycolmap.Reconstruction) -> None:
    config, options = adjustment_of(model, _STEPS)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    options.ceres.solver_options.function_tolerance = _TOLERANCE
    pycolmap.create_default_bundle_adjuster(options, config, model).solve()
