"""RGB-D odometry with loop closures: the front end of both RGB-D SLAM rows of table 2.

RTAB-Map is replaced by the same steps. Each frame is registered to the one before: features give
the motion, Open3D's hybrid (colour and depth) odometry refines it. Features are needed because a
camera that turns by several degrees per frame leaves the basin of direct odometry alone. Where
there are too few of them the motion of the pair before is the starting point. Keyframes that view
the same place are joined by loop closures.

A motion is accepted when the depth images agree under it and when the refinement stays near its
starting point. A consecutive pair that fails keeps its starting point as an edge of low weight, so
that the graph stays connected; a loop closure that fails is dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from PIL import Image

from baselines.groundtruth.features import FeatureOdometry, FrameFeatures
from baselines.groundtruth.posegraph.graph import Edge, PoseGraph
from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.models import CameraConfig, RgbdConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]

# Depth images hold millimetres; 0 and 65535 mean that nothing was hit.
_INVALID_MM = (0, 65535)
# Standard deviations of edges (metres, degrees), of the size measured on rendered rooms: of
# neighbours, of loop closures, which overlap less, and of guesses, as large as the motion itself.
_NEIGHBOUR, _LOOP, _GUESS = (0.003, 0.1), (0.01, 0.25), (0.1, 5.0)
# The refinement may not leave its starting point by more.
_MAX_CHANGE_M, _MAX_CHANGE_DEG = 0.25, 10.0
# Inliers below which features are no starting point for a neighbour, and for a loop closure.
_MIN_INLIERS, _MIN_LOOP_INLIERS = 8, 12
# Keyframes are compared when their optical axes and positions are at most this far apart.
_LOOP_MAX_DEG, _LOOP_MAX_M = 45.0, 2.0
# Every how many pixels, in both directions, depth images are compared.
_STRIDE = 4


@dataclass(frozen=True)
class _Frame:
    """One frame as the odometry needs it."""

    rgbd: o3d.t.geometry.RGBDImage
    depth_m: NDArray[np.float32]
    features: FrameFeatures


@dataclass(frozen=True)
class _Odometry:
    """What registering two frames needs besides them."""

    camera: CameraConfig
    cfg: RgbdConfig
    by_features: FeatureOdometry

    def load(self, color_path: Path, depth_path: Path) -> _Frame:
        """Read one frame; invalid depth becomes inf, or 0 for Open3D."""
        color = _read_image(color_path, self.camera, "RGB")
        grey = _read_image(color_path, self.camera, "L")
        depth_mm = _read_image(depth_path, self.camera)
        depth_m = np.where(np.isin(depth_mm, _INVALID_MM), np.inf, depth_mm / 1000)
        depth_m = np.where(depth_m > self.cfg.max_depth_m, np.inf, depth_m).astype(np.float32)
        finite_m = np.where(np.isfinite(depth_m), depth_m, np.float32(0))
        rgbd = o3d.t.geometry.RGBDImage(
            o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(np.ascontiguousarray(color))),
            o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(finite_m)),
        )
        return _Frame(rgbd, depth_m, self.by_features.features(grey, depth_m))

    def refine(self, i: _Frame, j: _Frame, i_from_j: Array) -> Array | None:
        """Refined and accepted ``i_from_j`` (4, 4) from a starting point, or None."""
        odometry = o3d.t.pipelines.odometry
        steps = [odometry.OdometryConvergenceCriteria(5)] * 3
        loss = odometry.OdometryLossParams()
        loss.depth_outlier_trunc = 2 * self.cfg.max_rmse_m
        try:
            result = odometry.rgbd_odometry_multi_scale(
                j.rgbd,
                i.rgbd,
                o3d.core.Tensor.from_numpy(intrinsics_of(self.camera).matrix(centre_shift_px=-0.5)),
                o3d.core.Tensor.from_numpy(i_from_j),
                1.0,
                self.cfg.max_depth_m,
                steps,
                odometry.Method.Hybrid,
                loss,
            )
        except RuntimeError:  # a singular system: nothing in view constrains the motion
            return None
        refined = result.transformation.numpy()
        change_m, change_rad = pose_error(i_from_j, refined)
        fitness, rmse_m = depth_agreement(i.depth_m, j.depth_m, refined, self.camera, self.cfg)
        near = change_m <= _MAX_CHANGE_M and np.degrees(change_rad) <= _MAX_CHANGE_DEG
        agrees = fitness >= self.cfg.min_fitness and rmse_m <= self.cfg.max_rmse_m
        return np.asarray(refined, dtype=np.float64) if near and agrees else None

    def neighbour(self, i: _Frame, j: _Frame, previous: Array) -> tuple[Array, bool]:
        """Motion ``i_from_j`` between neighbours and whether it was accepted."""
        found = self.by_features.motion(i.features, j.features)
        start = found[0] if found and found[1] >= _MIN_INLIERS else previous
        refined = self.refine(i, j, start)
        return (start, False) if refined is None else (refined, True)

    def loop(self, i: _Frame, j: _Frame) -> Array | None:
        """Motion ``i_from_j`` between keyframes, or None."""
        found = self.by_features.motion(i.features, j.features)
        if found is None or found[1] < _MIN_LOOP_INLIERS:
            return None
        return self.refine(i, j, found[0])


def rgbd_graph(
    color_paths: Sequence[Path], depth_paths: Sequence[Path], camera: CameraConfig, cfg: RgbdConfig
) -> PoseGraph:
    """Pose graph of one batch: an edge per neighbouring pair and the accepted loop closures.

    Args:
        color_paths: colour images in order.
        depth_paths: 16-bit depth images in millimetres, 65535 where nothing was hit.
        camera: camera of both.
        cfg: depth range, keyframes, and the gates of accepted motions.

    Returns:
        The graph with the chained odometry as initial poses.

    Raises:
        InputError: an image is missing or has another size than the camera.
        ValueError: colour and depth images differ in number.
    """
    o3d.utility.set_max_threads(1)
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    odometry = _Odometry(camera, cfg, FeatureOdometry(camera))
    frames = [odometry.load(*paths) for paths in zip(color_paths, depth_paths, strict=True)]
    poses, edges, motion = [np.eye(4)], [], np.eye(4)
    for j in range(1, len(frames)):
        motion, accepted = odometry.neighbour(frames[j - 1], frames[j], motion)
        poses.append(poses[-1] @ motion)
        edges.append(Edge(j - 1, j, motion, _information(_NEIGHBOUR if accepted else _GUESS)))
    first_from_cam = np.array(poses)
    for i, j in loop_candidates(first_from_cam, cfg.keyframe_every):
        closure = odometry.loop(frames[i], frames[j])
        if closure is not None:
            edges.append(Edge(i, j, closure, _information(_LOOP)))
    return PoseGraph(first_from_cam, tuple(edges))


def loop_candidates(first_from_cam: Array, keyframe_every: int) -> list[tuple[int, int]]:
    """Pairs of keyframes, i < j, whose views may overlap by their poses (n, 4, 4)."""
    keyframes = range(0, len(first_from_cam), keyframe_every)
    pairs = []
    for i in keyframes:
        for j in keyframes[keyframes.index(i) + 1 :]:
            distance_m = np.linalg.norm(first_from_cam[i, :3, 3] - first_from_cam[j, :3, 3])
            cosine = first_from_cam[i, :3, 2] @ first_from_cam[j, :3, 2]
            if distance_m <= _LOOP_MAX_M and cosine >= np.cos(np.radians(_LOOP_MAX_DEG)):
                pairs.append((i, j))
    return [(i, j) for i, j in pairs if j - i > 1]


def depth_agreement(
    depth_i_m: NDArray[np.float32],
    depth_j_m: NDArray[np.float32],
    i_from_j: Array,
    camera: CameraConfig,
    cfg: RgbdConfig,
) -> tuple[float, float]:
    """Overlap and residual of two depth images (H, W) under a motion (4, 4).

    Points of image j are projected into image i. A point agrees when its depth differs by at most
    twice ``max_rmse_m`` from the one measured there.

    Returns:
        The share of the points of j that agree, and the RMS of their depth differences in metres.
    """
    fx, fy, cx, cy = intrinsics_of(camera)
    focal, centre = np.array([fx, fy]), np.array([cx, cy])
    row, column = np.mgrid[0 : camera.height : _STRIDE, 0 : camera.width : _STRIDE].reshape(2, -1)
    z = depth_j_m[row, column].astype(np.float64)
    measured = np.isfinite(z)
    pixel = np.column_stack([column, row])[measured] + 0.5
    z = z[measured]
    point = np.column_stack([(pixel - centre) / focal * z[:, None], z])
    point = point @ i_from_j[:3, :3].T + i_from_j[:3, 3]
    point = point[point[:, 2] > 0]
    projected = np.floor(focal * point[:, :2] / point[:, 2:] + centre)
    inside = ((projected >= 0) & (projected < [camera.width, camera.height])).all(axis=1)
    column, row = projected[inside].astype(int).T
    difference = np.abs(depth_i_m[row, column] - point[inside, 2])
    agreeing = difference[difference <= 2 * cfg.max_rmse_m]
    if not len(agreeing):
        return 0.0, np.inf
    return len(agreeing) / len(z), float(np.sqrt(np.mean(agreeing**2)))


def _information(sigma: tuple[float, float]) -> Array:
    """Information (6, 6), translation first, from deviations in metres and degrees."""
    sigma_m, sigma_deg = sigma
    return np.diag([sigma_m**-2.0] * 3 + [np.radians(sigma_deg) ** -2.0] * 3)


def _read_image(path: Path, camera: CameraConfig, mode: str | None = None) -> NDArray[Any]:
    """An image of the camera's size as an array, converted to ``mode`` if one is given."""
    try:
        with Image.open(path) as image:
            pixels = np.asarray(image.convert(mode) if mode else image)
    except OSError as error:
        raise InputError(f"{path}: cannot be read as an image ({error})") from None
    if pixels.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"{path}: is {pixels.shape[1]}x{pixels.shape[0]}, the camera of the configuration"
            f" {camera.width}x{camera.height}; collect the data set again"
        )
    return pixels
