"""Registration of a depth image to a nearby surface, as in KinectFusion.

Points are matched by projection into the image of the surface, and moved towards its tangent
planes, coarse to fine (Newcombe et al., ISMAR 2011, section 3.5). Pairs that are far apart or whose
normals differ do not count, so borders, which move with the camera, do not hold it back.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import open3d as o3d
from numba import njit
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from baselines.labels.rgbd.dense import normals_of, points_of
from baselines.labels.rgbd.frames import near
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import pose_matrix

Array = NDArray[np.float64]
Depth = NDArray[np.float32]

# Every how many pixels are compared, and steps at the most: levels 3 to 1 of the paper.
LEVELS = ((4, 4), (2, 5), (1, 10))
# Pairs count up to this distance and this cosine of the angle between normals.
_MAX_PAIR_M, _MIN_COSINE = 0.1, np.cos(np.radians(30.0))
# Beyond this distance from the plane a pair counts by its distance, not its square.
_HUBER_M = 0.01
# A step that moves the camera by no more is the last of its level.
_REST_M, _REST_DEG = 1e-4, 0.005
# Systems that are constrained less are not solved.
_SINGULAR = 1e-9
# Smoothing of depth before normals are taken: pixels, deviations in metres and pixels.
_SMOOTHING = (5, 0.03, 2.0)


class PointNormalMap(NamedTuple):
    """Points and normals (h, w, 3) in the camera's frame, nan where there are none."""

    points: Array
    normals: Array


def pyramid_of(depth_m: Depth, camera: CameraConfig) -> list[PointNormalMap]:
    """Compute points and normals of a depth image at each of ``LEVELS``, coarse to fine.

    Args:
        depth_m: Depth (H, W), metres; not finite where nothing was measured.
        camera: Camera of the full image.
    """
    measured = np.where(np.isfinite(depth_m), depth_m, np.float32(np.nan))
    image = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(np.ascontiguousarray(measured)))
    smooth_m = image.filter_bilateral(*_SMOOTHING).as_tensor().numpy()[..., 0]
    return [_surface(measured[::s, ::s], smooth_m[::s, ::s], camera, s) for s, _ in LEVELS]


def _surface(depth_m: Depth, smooth_m: Depth, camera: CameraConfig, stride: int) -> PointNormalMap:
    """Build one level; its normals are those of the smoothed depth."""
    normals = np.full((*depth_m.shape, 3), np.nan)
    normals[1:-1, 1:-1] = normals_of(points_of(smooth_m, camera, stride))
    return PointNormalMap(points_of(depth_m, camera, stride), normals)


def register(
    shown: list[PointNormalMap], seen: list[PointNormalMap], camera: CameraConfig
) -> tuple[Array, float]:
    """Register a frame to the surface expected in its place, starting without motion.

    Args:
        shown: Surface that is expected, from :func:`pyramid_of`.
        seen: Surface that the frame measures, from :func:`pyramid_of`.
        camera: Camera of both.

    Returns:
        Motion ``shown_from_seen`` (4, 4), and how well the matched surfaces constrain it, at most
        1/3. The latter is 0 where some motion leaves them in place; the motion then means nothing.
    """
    motion = np.eye(4)
    for (stride, steps), target, source in zip(LEVELS, shown, seen, strict=True):
        fx, fy, cx, cy = camera.intrinsics
        projection = np.array([fx, fy, cx - 0.5, cy - 0.5]) / stride
        for _ in range(steps):
            system, right = _normal_equations(
                target_points=target.points,
                target_normals=target.normals,
                points=source.points,
                normals=source.normals,
                projection=projection,
                motion=motion,
            )
            constraint = _constraint(system)
            if constraint < _SINGULAR:
                return motion, 0.0
            step = np.linalg.solve(system, right)
            moved = pose_matrix(Rotation.from_rotvec(step[:3]).as_matrix(), step[3:])
            motion = moved @ motion
            if near(moved, np.eye(4), _REST_M, _REST_DEG):
                break
    return motion, constraint


def _constraint(system: Array) -> float:
    """Rate how well a system (6, 6) constrains a motion; 0 if one leaves the surface in place.

    The smallest eigenvalue of the mean over pairs, lengths measured so that turns and shifts weigh
    the same in it; 1/3 at the most (Gelfand et al., 3DIM 2003).
    """
    turns, shifts = np.trace(system[:3, :3]), np.trace(system[3:, 3:])
    if min(turns, shifts) <= 0:
        return 0.0
    scale = np.repeat([turns**-0.5, shifts**-0.5], 3)
    return float(np.linalg.eigvalsh(scale[:, None] * system * scale)[0])


@njit(cache=True)
def _normal_equations(
    target_points: Array,
    target_normals: Array,
    points: Array,
    normals: Array,
    projection: Array,
    motion: Array,
) -> tuple[Array, Array]:
    """Build the 6x6 system of the small turn, then shift, that lowers plane distances."""
    system, right = np.zeros((6, 6)), np.zeros(6)
    row = np.empty(6)
    height, width = points.shape[:2]
    rotation, shift = np.ascontiguousarray(motion[:3, :3]), motion[:3, 3]
    p, n = np.empty(3), np.empty(3)
    for i in range(height):
        for j in range(width):
            if not np.isfinite(points[i, j, 2] + normals[i, j, 0]):
                continue
            for k in range(3):
                p[k] = shift[k]
                n[k] = 0.0
                for m in range(3):
                    p[k] += rotation[k, m] * points[i, j, m]
                    n[k] += rotation[k, m] * normals[i, j, m]
            if p[2] <= 0.0:
                continue
            u = projection[0] * p[0] / p[2] + projection[2]
            v = projection[1] * p[1] / p[2] + projection[3]
            if not (-0.5 <= u < width - 0.5 and -0.5 <= v < height - 0.5):
                continue
            y, x = int(v + 0.5), int(u + 0.5)
            q, a = target_points[y, x], target_normals[y, x]
            d0, d1, d2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
            # nan compares as false
            if not d0 * d0 + d1 * d1 + d2 * d2 <= _MAX_PAIR_M**2:
                continue
            if not a[0] * n[0] + a[1] * n[1] + a[2] * n[2] >= _MIN_COSINE:
                continue
            distance = a[0] * d0 + a[1] * d1 + a[2] * d2
            weight = min(1.0, _HUBER_M / max(abs(distance), 1e-12))
            row[0] = p[1] * a[2] - p[2] * a[1]
            row[1] = p[2] * a[0] - p[0] * a[2]
            row[2] = p[0] * a[1] - p[1] * a[0]
            row[3:] = a
            for k in range(6):
                right[k] += weight * distance * row[k]
                for m in range(6):
                    system[k, m] += weight * row[k] * row[m]
    return system, right
