"""Depth images with poses fused into one surface.

A truncated signed distance field on Open3D's hashed grid of voxel blocks (Dong et al., "ASH: A
Modern Framework for Parallel Spatial Hashing in 3D Perception", PAMI 2022), and marching cubes.
Colours are no part of it: :mod:`synfeal.scanning.coloring` looks them up in the photographs, where
every lens and every offset between the cameras can be told exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import normalised_of_pixels, pixels_of_normalised
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import Depth
from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse
from synfeal.scanning.camera import RgbdCamera

Array = NDArray[np.float64]
# Voxels per edge of a block, blocks to begin with (more are added), truncation in voxels, and how
# many frames must have seen a surface for it to be kept: one alone is often a flying pixel.
BLOCK_VOXELS, BLOCKS, TRUNCATION_VOXELS, MIN_WEIGHT = 8, 20_000, 4.0, 1.5


def load_open3d() -> Any:
    """Import Open3D, which fuses depth.

    Raises:
        InputError: It is not installed.
    """
    try:
        import open3d
    except ImportError as error:
        raise InputError(
            "scan",
            f"needs Open3D, which does not load here ({error})",
            "pip install 'synfeal[scan]'",
        ) from error
    return open3d


def fuse_depth(
    grid: Any,
    depth: Any,
    matrix: Any,
    cam_from_grid: Any,
    max_depth_m: float,
    truncation_voxels: float,
) -> Any:
    """Add a depth image to a signed distance field.

    Args:
        grid: Open3D's ``VoxelBlockGrid`` with the attributes ``tsdf`` and ``weight``.
        depth: Open3D image, metres.
        matrix: Camera matrix (3, 3), a tensor. Projected positions are cut to whole pixels: with
            the centre of the first pixel at (0.5, 0.5) that is the nearest one.
        cam_from_grid: Pose (4, 4) of the grid in the camera's frame, a tensor.
        max_depth_m: Depth beyond is left out.
        truncation_voxels: Distance from the surface at which the field ends, voxels.

    Returns:
        Coordinates (M, 3) of the blocks that the image reaches, a tensor.
    """
    seen = grid.compute_unique_block_coordinates(
        depth, matrix, cam_from_grid, 1.0, max_depth_m, truncation_voxels
    )
    grid.integrate(seen, depth, matrix, cam_from_grid, 1.0, max_depth_m, truncation_voxels)
    return seen


@dataclass(frozen=True)
class FusedSurface:
    """Triangles without colours, in the world of the sequence.

    Attributes:
        vertices_m: (V, 3).
        normals: (V, 3), unit length, towards where the cameras were.
        faces: (F, 3), indices of vertices.
    """

    vertices_m: Array
    normals: Array
    faces: NDArray[np.int64]


def fuse(
    frames: PosedFrames,
    camera: RgbdCamera,
    voxel_m: float,
    max_depth_m: float,
    on_frame: Callable[[], object] = lambda: None,
) -> FusedSurface:
    """Fuse the depth images of frames.

    Args:
        frames: Depth images, and poses of their photographs.
        camera: Calibration.
        voxel_m: Edge of a voxel, metres.
        max_depth_m: Measurements beyond are left out.
        on_frame: Called after every frame.

    Raises:
        InputError: Open3D is not installed, or no depth image shows anything.
    """
    o3d = load_open3d()
    kind, scalar = o3d.core.float32, o3d.core.SizeVector([1])
    grid = o3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (kind, kind), (scalar, scalar), voxel_m, BLOCK_VOXELS, BLOCKS
    )
    flatten = Pinhole(camera.depth)
    # Open3D cuts projected positions to whole pixels: with the centre of the first pixel at
    # (0.5, 0.5) that is the nearest one.
    matrix = o3d.core.Tensor.from_numpy(camera.depth.intrinsics.matrix())
    color_from_depth = inverse(camera.depth_from_color)
    for file, world_from_color in zip(frames.depth, frames.world_from_cam, strict=True):
        assert file is not None
        depth_m = flatten(camera.read_depth_m(file))
        if ((depth_m > 0) & (depth_m < max_depth_m)).any():
            image = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(depth_m[..., None]))
            cam_from_world = o3d.core.Tensor.from_numpy(
                inverse(world_from_color @ color_from_depth)
            )
            fuse_depth(grid, image, matrix, cam_from_world, max_depth_m, TRUNCATION_VOXELS)
        on_frame()
    nothing = InputError(
        "scan",
        f"no surface within {max_depth_m:g} m is seen by two frames",
        "give a smaller `stride`, a larger `max_depth_m`, or `depth_scale` if depth is not in"
        " millimetres",
    )
    try:
        mesh = grid.extract_triangle_mesh(MIN_WEIGHT)
    except RuntimeError as error:  # Open3D's for a grid without any vertex
        raise nothing from error
    if "indices" not in mesh.triangle or not len(mesh.triangle["indices"]):
        raise nothing
    vertices, faces = ordered(
        mesh.vertex["positions"].numpy().astype(np.float64),
        mesh.triangle["indices"].numpy().astype(np.int64),
    )
    legacy = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces.astype(np.int32))
    )
    legacy.compute_vertex_normals()
    return FusedSurface(vertices, np.asarray(legacy.vertex_normals, np.float64), faces)


def ordered(vertices_m: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Order vertices and faces by where they are.

    Open3D's threads find them in another order each time, on which samples of vertices and sums
    over faces depend, and with them calibration and colours of a scan.

    Args:
        vertices_m: Vertices (V, 3).
        faces: Indices (F, 3) of vertices.

    Returns:
        The same vertices and faces; each face begins at its first vertex, and turns as before.
    """
    order = np.lexsort(vertices_m.T[::-1])
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    turned = rank[faces]
    first = turned.argmin(axis=1)
    turned = np.take_along_axis(turned, (first[:, None] + np.arange(3)) % 3, axis=1)
    return vertices_m[order], turned[np.lexsort(turned.T[::-1])]


class Pinhole:
    """Depth images of a lens as those of the pinhole camera with the same matrix."""

    def __init__(self, camera: CameraConfig) -> None:
        self._index: NDArray[np.int64] | None = None
        if any(camera.distortion):
            straight = camera.model_copy(update={"distortion": (0.0,) * 5})
            column, row = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
            pixel = np.stack([column, row], axis=-1).astype(np.float64) + 0.5
            seen = pixels_of_normalised(camera, normalised_of_pixels(straight, pixel))
            x, y = np.floor(np.nan_to_num(seen, nan=-1.0)).astype(np.int64).transpose(2, 0, 1)
            inside = (x >= 0) & (x < camera.width) & (y >= 0) & (y < camera.height)
            self._index = np.where(inside, y * camera.width + x, -1)

    def __call__(self, depth_m: Depth) -> Depth:
        """Resample depth (H, W) to the pinhole's nearest pixels, for edges are sharp; 0 outside."""
        if self._index is None:
            return depth_m
        return np.where(self._index >= 0, depth_m.reshape(-1)[self._index], np.float32(0.0))
