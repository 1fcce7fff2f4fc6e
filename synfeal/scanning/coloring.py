"""Colours of a surface from the photographs that see it.

Every vertex takes the weighted mean of what photographs show where it is projected: more of those
that see it from near and straight on, none of those where something stands before it. Looking
colours up in this way, instead of fusing them with depth, needs neither image to be of the other's
size, lens or place, and nothing that a voxel of the foreground covers bleeds into the wall behind.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse
from synfeal.scanning.camera import RgbdCamera
from synfeal.scanning.fusion import FusedSurface
from synfeal.scanning.seen import project, sampled, seen_points, within

MARGIN_PX = 2.0
NEIGHBOURS = 4  # coloured vertices whose mean an uncoloured one takes


def colors_of(
    surface: FusedSurface,
    frames: PosedFrames,
    camera: RgbdCamera,
    on_frame: Callable[[], object] = lambda: None,
) -> NDArray[np.uint8]:
    """Colour the vertices of a surface.

    Args:
        surface: In the world of the frames' poses.
        frames: Photographs with depth.
        camera: Calibration.
        on_frame: Called after every frame.

    Returns:
        Colours (V, 3). Vertices that no photograph shows take those of their neighbours.

    Raises:
        InputError: No photograph shows any of the surface.
    """
    points, normals = surface.vertices_m.astype(np.float32), surface.normals.astype(np.float32)
    total = np.zeros((len(points), 3), np.float32)
    weight = np.zeros(len(points), np.float32)
    color_from_depth = inverse(camera.depth_from_color)
    turn, shift = (part.astype(np.float32) for part in np.split(color_from_depth[:3], [3], axis=1))
    for index, world_from_color in enumerate(frames.world_from_cam):
        depth_file = frames.depth[index]
        assert depth_file is not None
        depth_m = camera.read_depth_m(depth_file)
        seen = seen_points(
            points, normals, depth_m, camera.depth, world_from_color @ color_from_depth
        )
        local = seen.in_depth_cam_m @ turn.T + shift[:, 0]
        pixel = project(local, camera.color)
        inside = within(pixel, camera.color.width, camera.color.height, MARGIN_PX)
        image = camera.read_color(frames.color[index])
        share = (seen.cosine / local[:, 2]) ** 2
        vertex = seen.index[inside]
        total[vertex] += sampled(image, pixel[inside]) * share[inside, None]
        weight[vertex] += share[inside]
        on_frame()
    known = weight > 0
    if not known.any():
        raise InputError(
            "scan", "no photograph shows the surface", "check `preset` or `color_camera`"
        )
    colors = np.zeros((len(points), 3), np.float32)
    colors[known] = total[known] / weight[known, None]
    if not known.all():
        tree = cKDTree(points[known])
        near = tree.query(points[~known], k=min(NEIGHBOURS, int(known.sum())))[1]
        near = near.reshape(len(near), -1)
        colors[~known] = colors[known][near].mean(axis=1)
    return np.rint(colors).clip(0, 255).astype(np.uint8)
