"""Gauge of a model: the place and scale that only true poses can give it.

``first_poses`` fits the model to the first true poses of the batch: as many as the published code
uses for the scale. Rotations are averaged over these cameras, then scale and shift follow from
their centres. So no single camera decides, and the centres of a straight path, which leave the
rotation about its line free, do not either.

``first_camera`` is the rule of the published code: the full pose of the first camera, and the scale
from distances to it. An error of that one camera, usually 0.15 to 1.05°, tilts the whole batch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.geometry.poses import pose_matrix

Array = NDArray[np.float64]
Gauge = Literal["first_poses", "first_camera"]

# The published code's frames for the scale, of which none nearer than 5 cm to the first counts.
GAUGE_FRAMES = 44
MIN_DISTANCE_M = 0.05
# Centres of cameras that stand closer together than this have no scale.
MIN_SPREAD_M = 0.01
# Places closer together than this share of their coordinates are one.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Similarity:
    """Map from a model to the world: ``x_world = scale * rotation @ x_model + shift_m``.

    Attributes:
        scale: Metres per unit of the model.
        rotation: Rotation (3, 3) ``world_from_model``.
        shift_m: Shift (3,) in the world, metres.
    """

    scale: float
    rotation: Array
    shift_m: Array

    def place(self, model_from_cam: Array) -> Array:
        """Return ``world_from_cam`` (N, 4, 4), metres, of poses in the model (N, 4, 4)."""
        rotation = self.rotation @ model_from_cam[:, :3, :3]
        centre_m = self.scale * model_from_cam[:, :3, 3] @ self.rotation.T + self.shift_m
        return pose_matrix(rotation, centre_m)


def placed(model_from_cam: Array, true_world_from_cam: Array, gauge: Gauge) -> Array | None:
    """Place the cameras of a model in the world.

    Args:
        model_from_cam: Poses (N, 4, 4) of the registered frames in the model, in order of time.
        true_world_from_cam: Their true poses (N, 4, 4), of which the gauge uses the first.
        gauge: True poses that it takes; see the module.

    Returns:
        ``world_from_cam`` (N, 4, 4), metres; None where there are fewer than two frames or they
        give no scale.
    """
    if len(model_from_cam) < 2:
        return None
    fit = fit_first_poses if gauge == "first_poses" else fit_first_camera
    similarity = fit(model_from_cam[:GAUGE_FRAMES], true_world_from_cam[:GAUGE_FRAMES])
    return None if similarity is None else similarity.place(model_from_cam)


def fit_first_poses(model_from_cam: Array, true_world_from_cam: Array) -> Similarity | None:
    """Fit a model to true poses: mean rotation over all cameras, then scale and shift.

    Args:
        model_from_cam: Poses (N, 4, 4) in the model.
        true_world_from_cam: True poses (N, 4, 4) of the same frames.

    Returns:
        The similarity; None where the cameras do not move.
    """
    rotation = mean_rotation(model_from_cam[:, :3, :3], true_world_from_cam[:, :3, :3])
    turned = model_from_cam[:, :3, 3] @ rotation.T
    true_m = true_world_from_cam[:, :3, 3]
    turned_mean, true_mean_m = turned.mean(axis=0), true_m.mean(axis=0)
    offset, true_offset_m = turned - turned_mean, true_m - true_mean_m
    rounding = ROUNDING * np.abs(turned).max()
    if np.abs(offset).max() <= rounding or np.abs(true_offset_m).max() < MIN_SPREAD_M:
        return None
    scale = float((offset * true_offset_m).sum() / (offset**2).sum())
    if scale <= 0:
        return None
    return Similarity(scale, rotation, true_mean_m - scale * turned_mean)


def mean_rotation(source_from_cam: Array, target_from_cam: Array) -> Array:
    """Average the rotation between two frames over cameras known in both.

    The chordal mean: the rotation R with the least sum of squares of ``R @ source - target``, by
    singular values (Hartley et al., "Rotation Averaging", IJCV 2013, section 5.3). Centres play no
    part, so it is determined by a single camera and by any straight path.

    Args:
        source_from_cam: Rotations (N, 3, 3).
        target_from_cam: Rotations (N, 3, 3) of the same cameras.

    Returns:
        ``target_from_source`` (3, 3).
    """
    u, _, vt = np.linalg.svd(np.einsum("nij,nkj->ik", target_from_cam, source_from_cam))
    sign = np.array([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)])
    return np.asarray((u * sign) @ vt)


def fit_first_camera(model_from_cam: Array, true_world_from_cam: Array) -> Similarity | None:
    """Fit a model to the true pose of the first camera, and to distances from it.

    Arguments and result are those of :func:`fit_first_poses`.
    """
    scale = metric_scale(true_world_from_cam[:, :3, 3], model_from_cam[:, :3, 3])
    if not math.isfinite(scale):
        return None
    rotation = true_world_from_cam[0, :3, :3] @ model_from_cam[0, :3, :3].T
    shift_m = true_world_from_cam[0, :3, 3] - scale * rotation @ model_from_cam[0, :3, 3]
    return Similarity(scale, rotation, shift_m)


def metric_scale(true_position_m: Array, position: Array) -> float:
    """Estimate metres per unit of the model from camera centres (n, 3), (n, 3) of the same frames.

    The published code takes the mean ratio of true to estimated distances from the first frame over
    its first 44 frames, leaving out those under 5 cm; the median is as simple and bears a wrong
    pose. NaN when no frame is left.
    """
    true_m = np.linalg.norm(true_position_m[:GAUGE_FRAMES] - true_position_m[0], axis=1)
    distance = np.linalg.norm(position[:GAUGE_FRAMES] - position[0], axis=1)
    usable = (true_m >= MIN_DISTANCE_M) & (distance > 0)
    return float(np.median(true_m[usable] / distance[usable])) if usable.any() else math.nan
