"""Covariance of a pose from the matches that agree with it.

The pose minimises a robust loss of reprojection errors, so their covariance carries over to it by
the Jacobian at the solution. How large these errors are is read from what is left of them
(residuals), not assumed.

Matches are not independent. A feature of the photograph is matched with the same thing in up to
twenty frames of the map, and neighbouring features show one surface, whose errors they share. So a
cluster of matches counts as one match with the cluster's mean information.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Of Cauchy's loss, pixels: that of COLMAP's refinement of absolute poses.
LOSS_PX = 1.0
# No feature is found more exactly, whatever the residuals of a few matches say.
LEAST_PX = 0.1


class Spread(NamedTuple):
    """Root of the mean squared error that a pose is expected to have.

    Attributes:
        position_m: Of its position.
        orientation_deg: Of its orientation.
    """

    position_m: float
    orientation_deg: float


def spread_of(covariance: Array) -> Spread:
    """Return the spread of a pose of this covariance (6, 6), see :func:`pose_covariance`."""
    variance = np.diag(covariance)
    position_m, orientation_rad = np.sqrt([variance[:3].sum(), variance[3:].sum()])
    return Spread(float(position_m), float(np.degrees(orientation_rad)))


def pose_covariance(
    pixel: Array,
    point_m: Array,
    world_from_cam: Array,
    focal_px: Array,
    cluster: Rows,
) -> Array:
    """Compute the covariance of a pose that was fitted to matches.

    Args:
        pixel: Pixels (n, 2) that show the points, measured from the principal point.
        point_m: Points (n, 3), world, metres.
        world_from_cam: The pose (4, 4).
        focal_px: Focal lengths (2,) along x and y.
        cluster: Number (n,) of the cluster that each match is of.

    Returns:
        Covariance (6, 6) of a small motion of the camera: its shift in metres and its turn in
        radians, both along the axes of the world. Infinite where the matches leave a motion free.
    """
    seen, slope = projected(point_m, world_from_cam, focal_px)
    squared_px = ((pixel - seen) ** 2).sum(axis=1)
    weight = 1.0 / (1.0 + squared_px / LOSS_PX**2)
    information = np.einsum("n,nai,naj->nij", weight, slope, slope)
    # Each match has two residuals; the pose takes up six of them.
    freedom = max(2.0 * len(pixel) - 6.0, 1.0)
    variance_px = max(float(squared_px.sum()) / freedom, LEAST_PX**2)
    _, number, size = np.unique(cluster, return_inverse=True, return_counts=True)
    total = (information / size[number, None, None]).sum(axis=0)
    if np.linalg.matrix_rank(total, hermitian=True) < 6:
        return np.full((6, 6), np.inf)
    return np.asarray(variance_px * np.linalg.inv(total))


def projected(point_m: Array, world_from_cam: Array, focal_px: Array) -> tuple[Array, Array]:
    """Project points, and tell how their pixels move with the camera.

    Args:
        point_m: Points (n, 3), world, metres.
        world_from_cam: Pose (4, 4) of the camera.
        focal_px: Focal lengths (2,) along x and y.

    Returns:
        Pixels (n, 2) from the principal point, and their derivative (n, 2, 6) by a shift of the
        camera in metres and a turn in radians, both along the axes of the world.
    """
    world_from_cam_turn = world_from_cam[:3, :3]
    away_m = point_m - world_from_cam[:3, 3]
    x, y, z = (away_m @ world_from_cam_turn).T
    pixel = np.stack([x / z, y / z], axis=1) * focal_px
    by_point = np.zeros((len(point_m), 2, 3))  # in the camera's axes
    by_point[:, 0, 0], by_point[:, 1, 1] = focal_px[0] / z, focal_px[1] / z
    by_point[:, :, 2] = -pixel / z[:, None]
    by_point = by_point @ world_from_cam_turn.T
    # A turn w of the camera moves what it sees as a turn -w of the points about it would.
    turned = np.stack([np.cross(away_m, axis) for axis in np.eye(3)], axis=-1)
    return pixel, np.concatenate([-by_point, by_point @ turned], axis=2)
