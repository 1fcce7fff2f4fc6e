"""Depth, pose and intrinsics belong together: what one frame sees, another sees where it should.

Pixels of one frame are lifted to the world by its depth and pose and projected into another frame,
from another place and turned about the optical axis, so that an error of the principal point or of
an axis does not cancel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from synfeal.camera.intrinsics import Intrinsics, intrinsics_of
from synfeal.config.models import CameraConfig
from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from tests.render_backends import BACKENDS, PYOPENGL_WARNS, opener_of
from tests.small_room import furnished_room

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

Floats = NDArray[np.float64]
CAMERA = CameraConfig(width=200, height=150, fx=160.0, fy=175.0, cx=86.3, cy=81.8)
SMOOTH_TEXELS = (24.0,)  # filtering changes such paint by less than a level
POSES = [
    pose_matrix(rotation_from_rpy(rpy), place)
    for rpy, place in (
        ((0.0, 0.2, 0.1), (1.6, 1.5, 1.4)),
        ((np.pi / 2.0, 0.1, 0.2), (2.0, 1.8, 1.6)),
        ((np.pi, 0.3, -0.1), (1.4, 1.9, 1.2)),
        ((-0.7, 0.2, 0.4), (2.2, 1.2, 1.7)),
    )
]
PAIRS = [(i, j) for i in range(len(POSES)) for j in range(len(POSES)) if i != j]


class Frame(NamedTuple):
    """One frame: colours (H, W), depth (H, W), and the pose it claims."""

    grey: Floats
    depth_m: Floats
    world_from_cam: Floats


class Residual(NamedTuple):
    """How far two frames are from agreeing.

    Attributes:
        px: median distance, in the first image, of what both see at one place.
        m: median distance in the world.
        shift_px: by how much the colours of one are shifted against those of the other.
        shared: share of the first frame's points in the second's view that are not hidden there.
    """

    px: float
    m: float
    shift_px: float
    shared: float


def lifted(pixel, depth_m, pose, intrinsics):
    """World points (N, 3) at depths (N,) behind places (N, 2) in the image."""
    fx, fy, cx, cy = intrinsics
    ray = np.column_stack([(pixel[:, 0] - cx) / fx, (pixel[:, 1] - cy) / fy, np.ones(len(pixel))])
    return (ray * depth_m[:, None]) @ pose[:3, :3].T + pose[:3, 3]


def projected(point, pose, intrinsics):
    """Places (N, 2) in the image and depths (N,) of world points (N, 3)."""
    cam_from_world = inverse(pose)
    in_cam = point @ cam_from_world[:3, :3].T + cam_from_world[:3, 3]
    z = in_cam[:, 2]
    fx, fy, cx, cy = intrinsics
    z_or_one = np.where(z > 0.1, z, 1.0)
    place = [fx * in_cam[:, 0] / z_or_one + cx, fy * in_cam[:, 1] / z_or_one + cy]
    return np.column_stack(place), z


def flat(depth_m):
    """1 where the surface is a plane: there, and only there, 1 / z is linear in the image."""
    inverse_depth = 1.0 / depth_m
    bend = np.zeros_like(depth_m)
    for axis in (0, 1):
        second = np.diff(inverse_depth, 2, axis=axis) / inverse_depth.mean()
        inner = (slice(1, -1), slice(None)) if axis == 0 else (slice(None), slice(1, -1))
        bend[inner] = np.maximum(bend[inner], np.abs(second))
    return (bend < 1e-4).astype(np.float64)


def at(image, pixel, order=1):
    """An image at places (N, 2); the centre of the first pixel is (0.5, 0.5)."""
    coordinates = (pixel - 0.5).T[::-1]
    return np.asarray(map_coordinates(image, coordinates, order=order, mode="nearest"))


def residual(first, second, intrinsics):
    """How far what the first frame sees is from what the second sees at the same place."""
    height, width = first.depth_m.shape
    row, column = np.indices((height, width))
    pixel = np.stack([column.ravel(), row.ravel()], axis=1) + 0.5
    pixel = pixel[flat(first.depth_m).ravel() == 1.0]
    point = lifted(pixel, at(first.depth_m, pixel, 0), first.world_from_cam, intrinsics)
    place, depth_m = projected(point, second.world_from_cam, intrinsics)
    inside = (place > 2.0).all(axis=1) & (place < [width - 2.0, height - 2.0]).all(axis=1)
    pixel, point, place, depth_m = (
        v[inside & (depth_m > 0.1)] for v in (pixel, point, place, depth_m)
    )
    seen_m = 1.0 / at(1.0 / second.depth_m, place)
    shared = (at(flat(second.depth_m), place) == 1.0) & (np.abs(seen_m / depth_m - 1.0) < 0.05)
    pixel, point, place = pixel[shared], point[shared], place[shared]
    other = lifted(place, seen_m[shared], second.world_from_cam, intrinsics)
    back, _ = projected(other, first.world_from_cam, intrinsics)
    return Residual(
        float(np.median(np.linalg.norm(back - pixel, axis=1))),
        float(np.median(np.linalg.norm(other - point, axis=1))),
        shift(second.grey, place, at(first.grey, pixel, 0)),
        float(np.mean(shared)),
    )


def shift(image, place, expected):
    """By how much places must move for the image to have the values expected there."""
    gradient = np.column_stack([at(g, place) for g in np.gradient(image)[::-1]])
    off = expected - at(image, place, order=3)
    usual = np.abs(off) <= 4.0 * np.median(np.abs(off)) + 1.0  # not where edges blur
    return float(np.linalg.norm(np.linalg.lstsq(gradient[usual], off[usual], rcond=None)[0]))


def frames_of(name):
    with opener_of(name)(furnished_room(SMOOTH_TEXELS), CAMERA) as renderer:
        images = [renderer.render_rgbd(pose) for pose in POSES]
    return [
        Frame(rgb.mean(axis=2), depth.astype(np.float64), pose)
        for (rgb, depth), pose in zip(images, POSES, strict=True)
    ]


@pytest.fixture(scope="module", params=BACKENDS)
def frames(request):
    return frames_of(request.param)


def worst(frames, intrinsics):
    """The worst of each figure over all pairs of frames."""
    found = [residual(frames[i], frames[j], intrinsics) for i, j in PAIRS]
    return Residual(
        max(r.px for r in found),
        max(r.m for r in found),
        max(r.shift_px for r in found),
        min(r.shared for r in found),
    )


def test_reprojection_closes(frames):
    found = worst(frames, intrinsics_of(CAMERA))
    assert found.shared > 0.9  # of the points that both have in view
    assert found.px <= 0.001
    assert found.m <= 1e-5
    assert found.shift_px <= 0.05


@pytest.mark.parametrize("shift_px", [(0.5, 0.0), (0.0, -0.5), (0.5, 0.5)])
def test_half_a_pixel_would_be_noticed(frames, shift_px):
    fx, fy, cx, cy = intrinsics_of(CAMERA)
    found = worst(frames, Intrinsics(fx, fy, cx + shift_px[0], cy + shift_px[1]))
    assert found.shift_px > 0.4
    assert found.px > 0.02
    assert found.m > 1e-3
