"""Overlaps of all frames with all others.

The overlap of frame a with frame b is the share of those of a's pixels with depth whose points are
visible in b (:mod:`synfeal.pairing.correspondence`). It is counted over the middles of equal cells
of a's image: with the 32 x 24 of the default, an overlap of 50 % is known to about 2 %.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import cell_centres_px
from synfeal.config.dataset import CameraConfig
from synfeal.pairing.correspondence import DepthImage, State, look_for, points_of_pixels

Array = NDArray[np.float64]
ReadDepth = Callable[[int], NDArray[np.float32]]

GRID = (32, 24)  # columns, rows
POINTS_AT_ONCE = 1 << 17  # 40 MB


def grid_points(
    camera: CameraConfig,
    read_depth_m: ReadDepth,
    poses: Array,
    grid: tuple[int, int],
    on_frame: Callable[[], object],
) -> Array:
    """Return the points (N, P, 3) in the world that the cells of N frames show; NaN for none.

    Args:
        camera: Camera of all frames.
        read_depth_m: Gives depth (H, W) of a frame, inf for nothing.
        poses: ``world_from_cam`` (N, 4, 4).
        grid: Columns and rows of cells, P in all.
        on_frame: Called for each frame.
    """
    pixel = cell_centres_px(camera, *grid).reshape(-1, 2)
    # The pixel in the middle, or the one after it, so that depth need not be interpolated.
    column, row = np.minimum(pixel.astype(int), [camera.width - 1, camera.height - 1]).T
    centre = np.stack([column, row], axis=-1) + 0.5
    points = np.empty((len(poses), len(pixel), 3))
    for index, pose in enumerate(poses):
        depth_m = read_depth_m(index)[row, column]
        points[index] = points_of_pixels(camera, centre, depth_m, pose)
        on_frame()
    return points


def overlaps_with(
    point_m: Array,
    frames: Sequence[int] | NDArray[np.int64],
    camera: CameraConfig,
    depth: DepthImage,
    world_from_cam: Array,
    tolerance: float,
) -> NDArray[np.float32]:
    """Return the overlaps (M,) of frames with one frame.

    Args:
        point_m: Points (N, P, 3) of :func:`grid_points`.
        frames: Which of the N frames (M,).
        camera: Camera of all frames.
        depth: Depth of the one frame.
        world_from_cam: Pose (4, 4) of the one frame.
        tolerance: Relative difference of depth up to which a point is visible.
    """
    rows = np.asarray(frames, np.int64)
    overlap = np.zeros(len(rows), np.float32)
    step = max(1, POINTS_AT_ONCE // point_m.shape[1])
    for start in range(0, len(rows), step):
        chunk = point_m[rows[start : start + step]]
        state = look_for(chunk, camera, depth, world_from_cam, tolerance).state
        known = np.count_nonzero(state != State.NO_DEPTH, axis=1)
        visible = np.count_nonzero(state == State.VISIBLE, axis=1)
        overlap[start : start + step] = visible / np.maximum(known, 1)
    return overlap
