"""Registration of two frames by Open3D's dense odometry, and when to believe it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.groundtruth.rgbd.agreement import constraint, depth_agreement
from baselines.groundtruth.rgbd.frames import RgbdFrame
from baselines.groundtruth.rgbd.surface import align
from synfeal.config.models import CameraConfig, RgbdConfig
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]

_METHODS = {
    "point-to-plane": o3d.t.pipelines.odometry.Method.PointToPlane,
    "hybrid": o3d.t.pipelines.odometry.Method.Hybrid,
    "intensity": o3d.t.pipelines.odometry.Method.Intensity,
}
# Passes of Open3D's own loop: steps per scale, coarse to fine, and the depth difference beyond
# which a point counts by its distance, not its square, as in the stages of ``surface``.
_PASSES = (((5, 3, 2), 0.05), ((5,), 0.002))
# The result may not leave its starting point by more.
MAX_CHANGE_M, MAX_CHANGE_DEG = 0.25, 10.0
# Motions are compared by the depth that agrees within this share of the accepted residual.
_CLOSE = 0.2
# A motion that agrees less is no longer sure: other starting points are tried.
SURE_AGREEMENT = 0.8
# Depth alone is trusted when the surfaces in view constrain the motion at least so well.
MIN_CONSTRAINT = 1e-3


@dataclass(frozen=True)
class Motion:
    """A motion that was found."""

    i_from_j: Array  # (4, 4)
    agreement: float  # share of the points of j whose depth agrees closely with image i


def near(a: Array, b: Array, max_m: float = MAX_CHANGE_M, max_deg: float = MAX_CHANGE_DEG) -> bool:
    """Whether a refined motion (4, 4) stays near its starting point (4, 4)."""
    change_m, change_rad = pose_error(a, b)
    return bool(change_m <= max_m and np.degrees(change_rad) <= max_deg)


def register(
    i: o3d.t.geometry.RGBDImage,
    j: o3d.t.geometry.RGBDImage,
    start: Array,
    camera: CameraConfig,
    cfg: RgbdConfig,
    method: str = "point-to-plane",
) -> Array | None:
    """Motion ``i_from_j`` (4, 4) near a starting point (4, 4), or None where there is none.

    By Open3D's own loop over scales, which knows all its methods.
    """
    odometry = o3d.t.pipelines.odometry
    matrix = o3d.core.Tensor.from_numpy(camera.intrinsics.matrix(centre_shift_px=-0.5))
    i_from_j = o3d.core.Tensor.from_numpy(np.ascontiguousarray(start))
    try:
        for steps, huber_m in _PASSES:
            i_from_j = odometry.rgbd_odometry_multi_scale(
                j,
                i,
                matrix,
                i_from_j,
                1.0,
                cfg.max_depth_m,
                [odometry.OdometryConvergenceCriteria(count) for count in steps],
                _METHODS[method],
                odometry.OdometryLossParams(2 * cfg.max_rmse_m, huber_m),
            ).transformation
    except RuntimeError:  # a singular system: nothing in view constrains the motion
        return None
    found = np.asarray(i_from_j.numpy(), dtype=np.float64)
    return found if np.isfinite(found).all() and near(start, found) else None


@dataclass(frozen=True)
class DenseOdometry:
    """What registering two frames needs besides them."""

    camera: CameraConfig
    cfg: RgbdConfig

    def constrained(self, frame: RgbdFrame) -> bool:
        """Whether what is compared can tell every motion of the camera."""
        if self.cfg.method != "point-to-plane":
            return True
        return constraint(frame.depth_m, self.camera) >= MIN_CONSTRAINT

    def overlap(self, i: RgbdFrame, j: RgbdFrame, i_from_j: Array) -> float:
        """Share of the points of j that agree with i under a motion (4, 4), 0 if rejected."""
        max_rmse_m = self.cfg.max_rmse_m
        fitness, rmse_m = depth_agreement(i.depth_m, j.depth_m, i_from_j, self.camera, max_rmse_m)
        return fitness if fitness >= self.cfg.min_fitness and rmse_m <= max_rmse_m else 0.0

    def refine(self, i: RgbdFrame, j: RgbdFrame, start: Array) -> Motion | None:
        """Refined and accepted motion ``i_from_j`` from a starting point (4, 4), or None."""
        found = self._moved(i, j, start)
        if found is None or not near(start, found) or not self.overlap(i, j, found):
            return None
        close_m = _CLOSE * self.cfg.max_rmse_m
        share, _ = depth_agreement(i.depth_m, j.depth_m, found, self.camera, close_m)
        return Motion(found, share)

    def _moved(self, i: RgbdFrame, j: RgbdFrame, start: Array) -> Array | None:
        """Refined motion (4, 4) that nothing has checked, or None."""
        if self.cfg.method == "point-to-plane":
            return align(i.surfaces, j.surfaces, start, 2 * self.cfg.max_rmse_m)
        return register(i.rgbd, j.rgbd, start, self.camera, self.cfg, self.cfg.method)
