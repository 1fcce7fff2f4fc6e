"""How much of the images would show nothing: known from a plan, before hours are spent on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.rays import normalised_of_pixels
from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.mesh.rays import RayCaster
from synfeal.planning.seen_surface import shown_frames

Array = NDArray[np.float64]

COLUMNS, ROWS = 16, 12  # rays of a frame: its share is then known to a few per cent
MOSTLY = 0.5  # of a frame


@dataclass(frozen=True)
class EmptyPixels:
    """Shares of what a plan's frames would see that is nothing.

    Attributes:
        share: of all pixels.
        worst_frame_share: of the pixels of the emptiest frame.
        mostly_empty_frames: share of the frames of which more than half is empty.
    """

    share: float
    worst_frame_share: float
    mostly_empty_frames: float


def empty_pixels(caster: RayCaster, plan: PoseTable, camera: CameraConfig) -> EmptyPixels:
    """Cast a grid of rays through up to 1,000 frames, spread evenly over the plan.

    A pixel is empty where nothing is between the near and the far plane. What an alpha test cuts
    out counts as solid.

    Args:
        caster: rays against the mesh.
        plan: the poses, at least one.
        camera: size, intrinsics, distortion and clip planes.
    """
    shares = empty_shares(caster, plan.world_from_cam[shown_frames(len(plan))], camera)
    return EmptyPixels(
        share=round(float(shares.mean()), 6),
        worst_frame_share=round(float(shares.max()), 6),
        mostly_empty_frames=round(float(np.mean(shares > MOSTLY)), 6),
    )


def empty_shares(caster: RayCaster, world_from_cam: Array, camera: CameraConfig) -> Array:
    """Share (N,) of the pixels that show nothing, from each of the poses (N, 4, 4)."""
    pixel = np.stack(
        np.meshgrid(
            (np.arange(COLUMNS) + 0.5) * camera.width / COLUMNS,
            (np.arange(ROWS) + 0.5) * camera.height / ROWS,
        ),
        axis=-1,
    ).reshape(-1, 2)
    normalised = normalised_of_pixels(camera, pixel)
    ray = np.column_stack(
        [normalised, np.ones(len(normalised))]
    )  # one metre along the optical axis
    shares = np.empty(len(world_from_cam))
    for index, pose in enumerate(world_from_cam):
        direction = ray @ pose[:3, :3].T
        start = pose[:3, 3] + camera.near_m * direction
        depth_m = camera.near_m + caster.first_hit_m(start, direction) / np.linalg.norm(ray, axis=1)
        shares[index] = np.mean(depth_m > camera.far_m)
    return shares
