"""Images of a mesh: from above without its ceiling, and from a point inside."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import TexturedMesh
from synfeal.render import open_renderer

Array = NDArray[np.float64]
Rgb = NDArray[np.uint8]

YAWS_DEG = (0, 90, 180, 270)
VIEW_CAMERA = CameraConfig(width=640, height=480, horizontal_fov_deg=75.0)
TOP_PX = 1100  # the longer side of the top view
TOP_FOV_DEG = 2.0  # so far away that the view is as good as orthographic
MARGIN = 0.04
WORLD_FROM_CAM_ABOVE: Array = np.diag([1.0, -1.0, -1.0])  # x right, y up in the image


class TopView(NamedTuple):
    """Colours (H, W, 3), white where nothing is, and the world they span: x0, x1, y0, y1."""

    rgb: Rgb
    extent_m: tuple[float, float, float, float]


def inside_views(mesh: TexturedMesh, position_m: Array) -> list[Rgb]:
    """What a level camera at (3,) sees at each of ``YAWS_DEG``."""
    with open_renderer(mesh, VIEW_CAMERA) as renderer:
        return [
            renderer.render(
                pose_matrix(rotation_from_rpy([0.0, 0.0, math.radians(yaw)]), position_m)
            )
            for yaw in YAWS_DEG
        ]


def top_view(mesh: TexturedMesh, cut_m: float) -> TopView:
    """The mesh below the height ``cut_m``, from far above: the near plane takes the ceiling off."""
    low, high = mesh.bounds_m
    middle = (low + high) / 2.0
    sides_m = (1.0 + 2.0 * MARGIN) * np.maximum(high - low, 1e-6)[:2]
    px_per_m = TOP_PX / float(sides_m.max())
    width, height = (int(px) for px in np.clip(np.round(sides_m * px_per_m), 16, TOP_PX))
    half = np.array([width, height]) / px_per_m / 2.0
    distance = float(half[0]) / math.tan(math.radians(TOP_FOV_DEG) / 2.0)
    camera = CameraConfig(
        width=width,
        height=height,
        horizontal_fov_deg=TOP_FOV_DEG,
        near_m=distance,
        far_m=distance + max(cut_m - float(low[2]), 0.0) + 0.01 * distance,
    )
    eye = [middle[0], middle[1], cut_m + distance]
    with open_renderer(mesh, camera) as renderer:
        rgb, depth = renderer.render_rgbd(pose_matrix(WORLD_FROM_CAM_ABOVE, eye))
    rgb[np.isinf(depth)] = 255
    (x0, y0), (x1, y1) = middle[:2] - half, middle[:2] + half
    return TopView(rgb, (float(x0), float(x1), float(y0), float(y1)))
