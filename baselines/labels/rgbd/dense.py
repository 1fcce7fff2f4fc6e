"""Dense registration of two frames, and independent checks of the motions it finds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.config.labels import RgbdConfig
from baselines.labels.rgbd.frames import RgbdFrame, align, motion_or_none, near
from synfeal.config.dataset import CameraConfig

Array = NDArray[np.float64]
Depth = NDArray[np.float32]

# Every how many pixels, in both directions, depth images are compared.
_STRIDE = 4
# Side of the blocks whose medians give normals, so that noise and rounding hardly tilt them, and
# the largest relative step of depth between neighbours of one surface.
_BLOCK, _MAX_STEP = 8, 0.1


def depth_agreement(
    depth_i_m: Depth, depth_j_m: Depth, i_from_j: Array, camera: CameraConfig, max_rmse_m: float
) -> tuple[float, float]:
    """Compute the overlap and residual of two depth images under a motion.

    Args:
        depth_i_m: Depth (H, W) of image i, metres.
        depth_j_m: Depth (H, W) of image j, metres.
        i_from_j: Motion (4, 4).
        camera: Camera of both.
        max_rmse_m: A point of image j agrees when its depth differs by at most twice this from the
            one measured there in image i, metres.

    Returns:
        The share of the points of j that agree, and the RMS of their depth differences in metres.
    """
    measured_m, moved_m, n_points = matched_depths(depth_i_m, depth_j_m, i_from_j, camera)
    difference = np.abs(measured_m - moved_m)
    agreeing = difference[difference <= 2 * max_rmse_m]
    if not len(agreeing):
        return 0.0, np.inf
    return len(agreeing) / n_points, float(np.sqrt(np.mean(agreeing**2)))


def matched_depths(
    depth_i_m: Depth, depth_j_m: Depth, i_from_j: Array, camera: CameraConfig
) -> tuple[Array, Array, int]:
    """Project the points of image j into image i, and pair their depths with those measured there.

    Args:
        depth_i_m: Depth (H, W) of image i, metres.
        depth_j_m: Depth (H, W) of image j, metres; every fourth row and column is used.
        i_from_j: Motion (4, 4).
        camera: Camera of both.

    Returns:
        For the n points that fall inside image i, the depth (n,) measured there, inf where there is
        none, and the depth (n,) of the points themselves; and the number of all points of j.
    """
    fx, fy, cx, cy = camera.intrinsics
    focal, centre = np.array([fx, fy]), np.array([cx, cy])
    point = points_of(depth_j_m[::_STRIDE, ::_STRIDE], camera, _STRIDE).reshape(-1, 3)
    point = point[np.isfinite(point[:, 2])]
    n_points = len(point)
    point = point @ i_from_j[:3, :3].T + i_from_j[:3, 3]
    point = point[point[:, 2] > 0]
    projected = np.floor(focal * point[:, :2] / point[:, 2:] + centre)
    inside = ((projected >= 0) & (projected < [camera.width, camera.height])).all(axis=1)
    column, row = projected[inside].astype(int).T
    return depth_i_m[row, column], point[inside, 2], n_points


def points_of(depth_m: Depth, camera: CameraConfig, stride: int, first: float = 0.5) -> Array:
    """Compute the points that depth pixels show.

    Args:
        depth_m: Every ``stride``-th row and column (h, w) of the camera's depth image, metres.
        camera: Camera of the full image.
        stride: Distance between rows and columns, pixels.
        first: Where the first row and column lie, pixels; 0.5 is the first pixel's centre.

    Returns:
        Points (h, w, 3) in the camera, metres; not finite where there is no depth.
    """
    fx, fy, cx, cy = camera.intrinsics
    row, column = np.indices(depth_m.shape) * stride + first
    z = depth_m.astype(np.float64)
    with np.errstate(invalid="ignore"):  # 0 * inf on the optical axis of an empty pixel
        return np.stack([(column - cx) / fx * z, (row - cy) / fy * z, z], axis=-1)


def normals_of(point_m: Array) -> Array:
    """Compute unit normals from the neighbours above, below, left and right.

    Args:
        point_m: Points (h, w, 3) of an image's pixels, in the camera, metres.

    Returns:
        Normals (h - 2, w - 2, 3) in the camera, away from it; NaN where the neighbours do not lie
        on one surface.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        down, right = point_m[2:, 1:-1] - point_m[:-2, 1:-1], point_m[1:-1, 2:] - point_m[1:-1, :-2]
        normal = np.cross(right, down)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        step = np.maximum(np.abs(down[..., 2]), np.abs(right[..., 2])) / point_m[1:-1, 1:-1, 2]
        return np.where((step <= _MAX_STEP)[..., None], normal, np.nan)


def constraint(depth_m: Depth, camera: CameraConfig) -> float:
    """Rate how well the surfaces in view constrain a motion; 0 if one motion leaves them in place.

    Distances to the tangent planes change under a small motion by ``normal . (v + w x point)``. The
    result is the smallest eigenvalue of the mean of the outer products of those rows, points
    measured in their RMS length. Their trace is 2 at the most, so the result is 1/3 at the most; it
    is 0 in front of a plane, a cylinder or a sphere (Gelfand et al., 3DIM 2003).
    """
    height, width = (side // _BLOCK for side in depth_m.shape)
    blocks = depth_m[: height * _BLOCK, : width * _BLOCK].reshape(height, _BLOCK, width, _BLOCK)
    median_m = np.median(blocks.transpose(0, 2, 1, 3).reshape(height, width, -1), axis=-1)
    point = points_of(median_m.astype(np.float32), camera, _BLOCK, _BLOCK / 2)
    normal = normals_of(point)
    smooth = np.isfinite(normal).all(axis=-1) & np.isfinite(point[1:-1, 1:-1, 2])
    if smooth.sum() < 6:
        return 0.0
    normal, point = normal[smooth], point[1:-1, 1:-1][smooth]
    moment = np.cross(point / np.sqrt(np.mean(np.sum(point**2, axis=-1))), normal)
    rows = np.hstack([normal, moment])
    return max(0.0, float(np.linalg.eigvalsh(rows.T @ rows / len(rows))[0]))


_METHODS = {
    "point-to-plane": o3d.t.pipelines.odometry.Method.PointToPlane,
    "hybrid": o3d.t.pipelines.odometry.Method.Hybrid,
    "intensity": o3d.t.pipelines.odometry.Method.Intensity,
}
# Passes of Open3D's own loop: steps per scale, coarse to fine, and the depth difference beyond
# which a point counts by its distance, not its square, as in the stages of ``surface``.
_PASSES = (((5, 3, 2), 0.05), ((5,), 0.002))
# Motions are compared by the depth that agrees within this share of the accepted residual.
_CLOSE = 0.2
# A motion that agrees less is no longer sure: other starting points are tried.
SURE_AGREEMENT = 0.8
# Depth alone is trusted when the surfaces in view constrain the motion at least so well.
MIN_CONSTRAINT = 1e-3


@dataclass(frozen=True)
class Motion:
    """A motion that was found.

    Attributes:
        i_from_j: Motion (4, 4) from camera j to camera i.
        agreement: Share of the points of j whose depth agrees closely with image i.
    """

    i_from_j: Array
    agreement: float


def register(
    i: o3d.t.geometry.RGBDImage,
    j: o3d.t.geometry.RGBDImage,
    start: Array,
    camera: CameraConfig,
    cfg: RgbdConfig,
    method: str = "point-to-plane",
) -> Array | None:
    """Find a motion by Open3D's own loop over scales, which knows all its methods.

    Args:
        i: Frame the motion leads to.
        j: Frame the motion comes from.
        start: Motion ``i_from_j`` (4, 4) to start from.
        camera: Camera of both.
        cfg: Settings of odometry.
        method: Name of Open3D's method.

    Returns:
        ``i_from_j`` (4, 4), or None if none is found.
    """
    odometry = o3d.t.pipelines.odometry
    matrix = o3d.core.Tensor.from_numpy(camera.intrinsics.matrix(centre_shift_px=-0.5))

    def estimate() -> o3d.core.Tensor:
        i_from_j = o3d.core.Tensor.from_numpy(np.ascontiguousarray(start))
        for steps, huber_m in _PASSES:
            i_from_j = odometry.rgbd_odometry_multi_scale(
                source=j,
                target=i,
                intrinsics=matrix,
                init_source_to_target=i_from_j,
                depth_scale=1.0,
                depth_max=cfg.max_depth_m,
                criteria_list=[odometry.OdometryConvergenceCriteria(count) for count in steps],
                method=_METHODS[method],
                params=odometry.OdometryLossParams(2 * cfg.max_rmse_m, huber_m),
            ).transformation
        return i_from_j

    return motion_or_none(estimate)


@dataclass(frozen=True)
class DenseOdometry:
    """Registration of pairs of frames with one camera and one set of settings."""

    camera: CameraConfig
    cfg: RgbdConfig

    def constrained(self, frame: RgbdFrame) -> bool:
        """Check that what is compared in this frame can tell every motion of the camera."""
        if self.cfg.method != "point-to-plane":
            return True
        return constraint(frame.depth_m, self.camera) >= MIN_CONSTRAINT

    def overlap(self, i: RgbdFrame, j: RgbdFrame, i_from_j: Array) -> float:
        """Compute the share of the points of j whose depth agrees with i under a motion.

        Args:
            i: Frame the motion leads to.
            j: Frame the motion comes from.
            i_from_j: Motion (4, 4).

        Returns:
            The share, 0 to 1; 0 also where it, or the RMS of the depth differences, misses the
            limit of the settings.
        """
        max_rmse_m = self.cfg.max_rmse_m
        fitness, rmse_m = depth_agreement(i.depth_m, j.depth_m, i_from_j, self.camera, max_rmse_m)
        return fitness if fitness >= self.cfg.min_fitness and rmse_m <= max_rmse_m else 0.0

    def refine(self, i: RgbdFrame, j: RgbdFrame, start: Array) -> Motion | None:
        """Refine a motion, and accept it if it stays near its start and the depths agree.

        Args:
            i: Frame the motion leads to.
            j: Frame the motion comes from.
            start: Motion ``i_from_j`` (4, 4) to start from.

        Returns:
            The refined motion; None where none is found or accepted.
        """
        if self.cfg.method == "point-to-plane":
            found = align(i.surfaces, j.surfaces, start, 2 * self.cfg.max_rmse_m)
        else:
            found = register(i.rgbd, j.rgbd, start, self.camera, self.cfg, self.cfg.method)
        if found is None or not near(start, found) or not self.overlap(i, j, found):
            return None
        close_m = _CLOSE * self.cfg.max_rmse_m
        share, _ = depth_agreement(i.depth_m, j.depth_m, found, self.camera, close_m)
        return Motion(found, share)
