"""Optical flow between two frames of any distance, with what is hidden and what leaves the image.

``flow_px[row, column]`` is the way, in pixels, from the centre of a pixel of frame a to where frame
b shows, or would show, the point: x right, y down. It is finite wherever frame a has depth and the
camera of b can show the point, visible or not, inside the image or not; NaN elsewhere. ``state`` is
:class:`synfeal.pairing.correspondence.State` of each pixel.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import cell_centres_px, pixel_offset
from synfeal.config.dataset import CameraConfig
from synfeal.errors import read_as
from synfeal.pairing.correspondence import (
    TOLERANCE,
    Array,
    DepthImage,
    State,
    look_for,
    points_of_pixels,
)
from synfeal.records.files import atomic_path

ARRAYS = ("flow_ab", "state_ab", "flow_ba", "state_ba")


class Flow(NamedTuple):
    """Flow from one frame to another.

    Attributes:
        flow_px: (H, W, 2) float32, x and y; NaN where there is none.
        state: (H, W) uint8, a :class:`~synfeal.pairing.correspondence.State`.
    """

    flow_px: NDArray[np.float32]
    state: NDArray[np.uint8]

    @property
    def is_visible(self) -> NDArray[np.bool_]:
        """Pixels (H, W) whose point the other frame shows."""
        visible: NDArray[np.bool_] = self.state == State.VISIBLE
        return visible


def flow_between(
    camera: CameraConfig,
    depth_a_m: NDArray[np.floating],
    world_from_a: Array,
    depth_b_m: NDArray[np.floating],
    world_from_b: Array,
    tolerance: float = TOLERANCE,
) -> Flow:
    """Compute the flow from frame a to frame b.

    Args:
        camera: Camera of both.
        depth_a_m: Depth (H, W) of a, inf for nothing.
        world_from_a: Pose (4, 4) of a.
        depth_b_m: Depth (H, W) of b.
        world_from_b: Pose (4, 4) of b.
        tolerance: Relative difference of depth up to which a point is visible.
    """
    pixel = cell_centres_px(camera, camera.width, camera.height)
    point_m = points_of_pixels(camera, pixel, depth_a_m, world_from_a)
    seen = look_for(point_m, camera, DepthImage(depth_b_m), world_from_b, tolerance)
    return Flow(pixel_offset(camera, pixel, seen.pixel).astype(np.float32), seen.state)


def write_flows(path: Path, ab: Flow, ba: Flow) -> None:
    """Write the flows of a pair in both directions as one compressed ``.npz``."""
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file,
            flow_ab=ab.flow_px,
            state_ab=ab.state,
            flow_ba=ba.flow_px,
            state_ba=ba.state,
        )


def read_flows(path: Path | str) -> tuple[Flow, Flow]:
    """Read the flows of a pair: from a to b, and from b to a.

    Raises:
        InputError: The file is missing or no such file.
    """
    remedy = "; run pairs with `flow=True` again"
    # A damaged archive is refused in every way there is.
    with read_as(path, "optical flow", Exception, remedy=remedy), np.load(path) as held:
        flow_ab, state_ab, flow_ba, state_ba = (held[name] for name in ARRAYS)
    return Flow(flow_ab, state_ab), Flow(flow_ba, state_ba)
