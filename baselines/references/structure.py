"""Structure-based localization: poses from matches with a map of 3D points.

As in Sattler et al. (PAMI 2017) and hloc (Sarlin et al., CVPR 2019): the training images that look
most alike are retrieved, features matched with theirs, and the camera pose found by P3P in
LO-RANSAC, then refined on the inliers (COLMAP's implementation). Points come from depth, or from
the rays of many frames; either way the map carries the errors of the labels it is built from.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.references.correspondences import Correspondences, Tracks
from baselines.references.evidence import Evidence
from baselines.registry.kinds import ReferenceMethod
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import inverse, pose_matrix

Array = NDArray[np.float64]

MAX_ERROR_PX = 4.0
# With noisy labels no share of inliers ends RANSAC early; more trials do not help then.
CONFIDENCE, MAX_TRIALS = 0.9999, 500
# Poses on fewer inliers than this are no better than guesses.
MIN_INLIERS = 8


@ReferenceMethod(
    name="structure-depth",
    title="Structure, points from depth",
    rank=4,
    group="structure",
    query=("vlad", "features", "matches"),
)
def on_depth(evidence: Evidence) -> Array:
    """Find poses (N, 4, 4) against features lifted by training depth; NaN where none is found."""
    with evidence.preparing():
        matches = evidence.correspondences
        places = lifted(matches, evidence.train)
    return localize(matches, places, evidence.camera, evidence.seed)


def lifted(matches: Correspondences, train: PoseTable) -> Array:
    """Lift matches to points (C, 3) in the world by the depth of the training frames.

    NaN where that frame has no depth, or a label that was only filled in.
    """
    world_from_cam = train.world_from_cam[matches.train]
    with np.errstate(invalid="ignore"):  # no depth
        turned = np.einsum("cij,cj->ci", world_from_cam[:, :3, :3], matches.point_m)
    unusable = np.isin(matches.train, train.usable_rows, invert=True)
    return np.where(unusable[:, None], np.nan, turned + world_from_cam[:, :3, 3])


def localize(
    matches: Correspondences,
    point_m: Array,
    seen_by: CameraConfig,
    seed: int,
    max_error_px: float = MAX_ERROR_PX,
) -> Array:
    """Find the poses of test frames from their matches.

    Args:
        matches: Matches (C) of test features with training features.
        point_m: Where the training feature of each match lies (C, 3), world, metres; not finite
            where that is not known.
        seen_by: Camera of the test frames.
        seed: Seed of RANSAC's samples.
        max_error_px: Largest reprojection error of an inlier, pixels.

    Returns:
        Poses ``world_from_cam`` (N, 4, 4); NaN where none is found.
    """
    camera = pinhole(seen_by)
    known = np.asarray(np.isfinite(point_m).all(axis=1))
    rows = [np.flatnonzero(known[own]) + own.start for own in map(matches.of, range(len(matches)))]
    pixel = matches.slope * camera.params[:2]
    return np.array(
        [absolute_pose(pixel[own], point_m[own], camera, seed, max_error_px) for own in rows]
    )


def absolute_pose(
    pixel: Array,
    point_m: Array,
    camera: pycolmap.Camera,
    seed: int,
    max_error_px: float = MAX_ERROR_PX,
) -> Array:
    """Estimate a pose as :func:`supported_pose` does, for stacking with those of other frames.

    Arguments are the same.

    Returns:
        ``world_from_cam`` (4, 4); NaN where no pose is found.
    """
    found = supported_pose(pixel, point_m, camera, seed, max_error_px)
    return np.full((4, 4), np.nan) if found is None else found.world_from_cam


class SupportedPose(NamedTuple):
    """A pose and the matches that agree with it.

    Attributes:
        world_from_cam: Pose (4, 4).
        inlier: Matches (n,) that agree with it.
    """

    world_from_cam: Array
    inlier: NDArray[np.bool_]


def supported_pose(
    pixel: Array,
    point_m: Array,
    camera: pycolmap.Camera,
    seed: int,
    max_error_px: float = MAX_ERROR_PX,
) -> SupportedPose | None:
    """Estimate a pose by P3P in LO-RANSAC, refined on its inliers.

    Args:
        pixel: Pixels (n, 2) that show the points, measured from the principal point.
        point_m: Points (n, 3), world, metres; all finite.
        camera: Camera without distortion, its principal point at 0.
        seed: Seed of RANSAC's samples.
        max_error_px: Largest reprojection error of an inlier, pixels.

    Returns:
        The pose; None where fewer than ``MIN_INLIERS`` matches agree on one.
    """
    if len(pixel) < MIN_INLIERS:
        return None
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = max_error_px
    options.ransac.confidence = CONFIDENCE
    options.ransac.max_num_trials = MAX_TRIALS
    options.ransac.random_seed = seed % 2**31
    found = pycolmap.estimate_and_refine_absolute_pose(pixel, point_m, camera, options)
    if found is None or found["num_inliers"] < MIN_INLIERS:
        return None
    cam_from_world = found["cam_from_world"].matrix()
    pose = inverse(pose_matrix(cam_from_world[:, :3], cam_from_world[:, 3]))
    return SupportedPose(pose, np.asarray(found["inlier_mask"], dtype=bool))


def refined_pose(
    pixel: Array,
    point_m: Array,
    world_from_cam: Array,
    inlier: NDArray[np.bool_],
    camera: pycolmap.Camera,
) -> Array:
    """Refine a pose on matches that agree with it.

    Args:
        pixel: Pixels (n, 2) that show the points, from the principal point.
        point_m: Points (n, 3) in the world.
        world_from_cam: Pose (4, 4) to start from.
        inlier: Matches (n,) to refine it on.
        camera: Camera without distortion, its principal point at 0.

    Returns:
        The pose (4, 4) that misses these matches least; the one given where none is found.
    """
    start = pycolmap.Rigid3d(inverse(world_from_cam)[:3])
    found = pycolmap.refine_absolute_pose(start, pixel, point_m, inlier, camera)
    if found is None:
        return world_from_cam
    cam_from_world = found["cam_from_world"].matrix()
    return inverse(pose_matrix(cam_from_world[:, :3], cam_from_world[:, 3]))


def refined_focal_px(
    pixel: Array, point_m: Array, world_from_cam: Array, camera: pycolmap.Camera
) -> float:
    """Refine a pose together with the focal length.

    Args:
        pixel: Pixels (n, 2) that show the points, from the principal point.
        point_m: Points (n, 3) in the world; some may be wrong matches.
        world_from_cam: Pose (4, 4) to start from.
        camera: Camera without distortion, whose focal length along x is where that starts.

    Returns:
        The focal length in pixels at which the points are missed least; NaN where it is not found.
    """
    free = pycolmap.Camera(
        model="SIMPLE_PINHOLE",
        width=camera.width,
        height=camera.height,
        params=[camera.params[0], 0.0, 0.0],
    )
    options = pycolmap.AbsolutePoseRefinementOptions()
    options.refine_focal_length = True
    start = pycolmap.Rigid3d(inverse(world_from_cam)[:3])
    everyone = np.ones(len(pixel), dtype=bool)
    found = pycolmap.refine_absolute_pose(start, pixel, point_m, everyone, free, options)
    return float("nan") if found is None else float(free.params[0])


def missed_px(pixel: Array, point_m: Array, world_from_cam: Array, focal_px: Array) -> Array:
    """Compute by how much a pose misses matches; infinity behind the camera.

    Args:
        pixel: Positions (m, 2) from the principal point.
        point_m: Matched points (m, 3) in the world.
        world_from_cam: Pose (4, 4).
        focal_px: Focal lengths (2,).

    Returns:
        Distances (m,), pixels.
    """
    cam_from_world = inverse(world_from_cam)
    in_cam_m = point_m @ cam_from_world[:3, :3].T + cam_from_world[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = in_cam_m[:, :2] / in_cam_m[:, 2:] * focal_px
        missed = np.linalg.norm(seen - pixel, axis=1)
    return np.where(in_cam_m[:, 2] > 0, missed, np.inf)


def pinhole(camera: CameraConfig) -> pycolmap.Camera:
    """Return a camera without distortion and with its principal point at (0, 0)."""
    fx, fy, _, _ = camera.intrinsics
    return pycolmap.Camera(
        model="PINHOLE", width=camera.width, height=camera.height, params=[fx, fy, 0.0, 0.0]
    )


ROUNDS = 4
# Rays further from a point than this angle lose weight (Cauchy): about 2 px at 320 pixels.
SCALE_RAD = 0.007


@ReferenceMethod(
    name="structure-rays",
    title="Structure, points triangulated",
    rank=5,
    group="structure",
    query=("vlad", "features", "matches"),
)
def triangulated(evidence: Evidence) -> Array:
    """Find poses (N, 4, 4) against points triangulated from the labels; NaN where none is found."""
    with evidence.preparing():
        point_m = triangulate(evidence.tracks, evidence.train.world_from_cam)
    return on_points(evidence, point_m)


def on_points(evidence: Evidence, point_m: Array) -> Array:
    """Find the poses of the test frames against the points (T, 3) of the tracks."""
    with evidence.preparing():
        matches, tracks = evidence.correspondences, evidence.tracks
    track = tracks.of_feature[matches.feature]
    places = np.full((len(track), 3), np.nan)
    places[track >= 0] = point_m[track[track >= 0]]
    return localize(matches, places, evidence.camera, evidence.seed)


def triangulate(tracks: Tracks, world_from_cam: Array) -> Array:
    """Compute points (T, 3) nearest to their tracks' rays; NaN behind a camera or at no angle.

    Least squares of the distances to the rays from the frames' poses (N, 4, 4), reweighted by the
    angle under which the point is missed; a single wrong match then loses its say.
    """
    pose = world_from_cam[tracks.frame]
    centre = pose[:, :3, 3]
    ray = np.einsum("mij,mj->mi", pose[:, :3, :3], np.insert(tracks.slope, 2, 1, axis=1))
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
    """Triangulate points (T, 3) from centres (M, 3) and weighted projections (M, 3, 3)."""
    left = np.zeros((tracks.count, 3, 3))
    right = np.zeros((tracks.count, 3))
    np.add.at(left, tracks.track, across)
    np.add.at(right, tracks.track, np.einsum("mij,mj->mi", across, centre))
    flat = np.linalg.eigvalsh(left)
    parallel = flat[:, 0] <= 1e-4 * flat[:, 2]  # rays within about a degree, or none
    left[parallel] = np.eye(3)
    point_m = np.linalg.solve(left, right[..., None])[..., 0].astype(np.float64)
    point_m[parallel] = np.nan
    return point_m
