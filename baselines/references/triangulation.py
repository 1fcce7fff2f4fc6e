"""Structure without depth: points from the rays of many frames, as the labels place them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.references.evidence import Evidence
from baselines.references.structure import localize
from baselines.references.tracks import Tracks

Array = NDArray[np.float64]

ROUNDS = 4
# Rays further from a point than this angle lose weight (Cauchy): about 2 px at 320 pixels.
SCALE_RAD = 0.007


def triangulated(evidence: Evidence) -> Array:
    """Poses (N, 4, 4) against points triangulated from the labels; NaN where none is found."""
    return on_points(evidence, triangulate(evidence.tracks, evidence.train.world_from_cam))


def on_points(evidence: Evidence, point_m: Array) -> Array:
    """Poses of the test frames against the points (T, 3) of the tracks."""
    track = evidence.tracks.of_feature[evidence.correspondences.feature]
    places = np.full((len(track), 3), np.nan)
    places[track >= 0] = point_m[track[track >= 0]]
    return localize(evidence.correspondences, places, evidence.camera, evidence.seed)


def triangulate(tracks: Tracks, world_from_cam: Array) -> Array:
    """Points (T, 3) nearest to the rays of their tracks; NaN behind a camera or at no angle.

    Least squares of the distances to the rays, reweighted by the angle under which the point is
    missed; a single wrong match then loses its say.

    Args:
        tracks: T tracks.
        world_from_cam: (N, 4, 4) poses of the frames.
    """
    pose = world_from_cam[tracks.frame]
    centre = pose[:, :3, 3]
    ray = np.einsum("mij,mj->mi", pose[:, :3, :3], _homogeneous(tracks.slope))
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    across = np.eye(3) - ray[:, :, None] * ray[:, None, :]
    weight = np.ones(len(ray))
    point_m = np.zeros((tracks.count, 3))
    for _ in range(ROUNDS):
        point_m = _meet(tracks, centre, across * weight[:, None, None])
        away = point_m[tracks.track] - centre
        depth = np.einsum("mi,mi->m", away, ray)
        miss_rad = np.arctan2(np.linalg.norm(away - depth[:, None] * ray, axis=1), depth)
        weight = 1 / (1 + (miss_rad / SCALE_RAD) ** 2) / np.maximum(depth, 0.1) ** 2
        # Rays that do not meet keep their weight.
        weight = np.where(np.isfinite(weight), weight, 1.0)
    behind = np.bincount(tracks.track, depth <= 0, tracks.count) > 0
    point_m[behind] = np.nan
    return point_m


def _meet(tracks: Tracks, centre: Array, across: Array) -> Array:
    """Points (T, 3) from centres (M, 3) and weighted projections (M, 3, 3) across the rays."""
    left = np.zeros((tracks.count, 3, 3))
    right = np.zeros((tracks.count, 3))
    np.add.at(left, tracks.track, across)
    np.add.at(right, tracks.track, np.einsum("mij,mj->mi", across, centre))
    flat = np.linalg.eigvalsh(left)
    parallel = flat[:, 0] < 1e-4 * flat[:, 2]  # rays within about a degree
    left[parallel] = np.eye(3)
    point_m = np.linalg.solve(left, right[..., None])[..., 0].astype(np.float64)
    point_m[parallel] = np.nan
    return point_m


def _homogeneous(slope: Array) -> Array:
    return np.column_stack([slope, np.ones(len(slope))])
