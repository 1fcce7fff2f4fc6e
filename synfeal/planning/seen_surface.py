"""What a plan's frames see: how much of a scene's surface, and how much of nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.camera.distortion import fold_radius
from synfeal.camera.projection import cell_directions, pixels_of_normalised
from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles

Array = NDArray[np.float64]

N_POINTS = 20_000  # a share of one half is then known to 0.4 % (standard error)
MAX_FRAMES = 1_000
OFTEN = 3  # frames
FARTHEST_M = 5.0
LIFT_M = 0.01  # rays stop this far in front of the surface they are to reach


class SeenSurface(NamedTuple):
    """Counts of surface points."""

    visible: int  # those that can be seen from the free space at all
    seen: int  # of these, those in at least one frame
    seen_often: int  # of these, those in at least ``OFTEN`` frames


def seen_surface(
    mesh: Triangles, caster: RayCaster, hubs_m: Array, plan: PoseTable, camera: CameraConfig
) -> SeenSurface:
    """Look at ``N_POINTS`` points, uniform over the surface, from up to ``MAX_FRAMES`` frames.

    A point is in a frame if it is projected into the image, no farther than ``FARTHEST_M``, and
    nothing is in front of it. From either side: scans have holes, and walls without thickness. What
    none of the places ``hubs_m`` (H, 3) in the free space sees cannot be seen.
    """
    surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    points, _ = trimesh.sample.sample_surface(surface, N_POINTS, seed=0)
    points = visible_points(caster, hubs_m, np.asarray(points, dtype=np.float64))
    times = np.zeros(len(points), dtype=np.int64)
    for world_from_cam in plan.world_from_cam[shown_frames(len(plan))]:
        left = np.flatnonzero(times < OFTEN)
        left = left[in_image(camera, world_from_cam, points[left])]
        times[left] += has_line(caster, world_from_cam[:3, 3], points[left])
    return SeenSurface(len(points), int(np.sum(times > 0)), int(np.sum(times >= OFTEN)))


def shown_frames(n_frames: int) -> NDArray[np.int64]:
    """Indices of at most ``MAX_FRAMES`` frames, spread evenly over all."""
    return np.linspace(0, n_frames - 1, min(n_frames, MAX_FRAMES)).round().astype(np.int64)


def visible_points(caster: RayCaster, places_m: Array, points_m: Array) -> Array:
    """Those of the surface points (N, 3) that at least one place (P, 3) sees."""
    found = np.zeros(len(points_m), dtype=np.bool_)
    for place in places_m:
        left = np.flatnonzero(~found)
        found[left] = has_line(caster, place, points_m[left])
    return points_m[found]


def has_line(caster: RayCaster, place_m: Array, points_m: Array) -> NDArray[np.bool_]:
    """Whether nothing is between a place (3,) and surface points (N, 3), (N,)."""
    towards = place_m - points_m
    length_m = np.linalg.norm(towards, axis=1, keepdims=True)
    lifted = points_m + towards * np.minimum(LIFT_M / np.maximum(length_m, LIFT_M), 1.0)
    return caster.sees(np.broadcast_to(place_m, lifted.shape), lifted)


def in_image(camera: CameraConfig, world_from_cam: Array, points_m: Array) -> NDArray[np.bool_]:
    """Whether points (N, 3) are projected into the image of a pose (4, 4), within reach, (N,)."""
    offset = points_m - world_from_cam[:3, 3]
    at = offset @ world_from_cam[:3, :3]
    reached = np.einsum("ni,ni->n", at, at) <= FARTHEST_M**2
    inside: NDArray[np.bool_] = reached & (at[:, 2] > camera.near_m)
    normalised = at[inside, :2] / at[inside, 2:]
    pixel = pixels_of_normalised(camera, normalised)
    within = ((pixel >= 0.0) & (pixel <= [camera.width, camera.height])).all(axis=1)
    # Beyond its fold a lens model maps what is far outside back into the image.
    inside[inside] = within & (np.linalg.norm(normalised, axis=1) < fold_radius(camera.distortion))
    return inside


COLUMNS, ROWS = 16, 12  # rays of a frame: its share is then known to a few per cent
MOSTLY = 0.5  # of a frame


@dataclass(frozen=True)
class EmptyPixels:
    """Shares of what a plan's frames would see that is nothing."""

    share: float  # of all pixels
    worst_frame_share: float  # of the pixels of the emptiest frame
    mostly_empty_frames: float  # share of the frames of which more than half is empty


def empty_pixels(caster: RayCaster, plan: PoseTable, camera: CameraConfig) -> EmptyPixels:
    """Cast a grid of rays through up to 1,000 frames, spread evenly over a plan of at least one.

    A pixel is empty where nothing is between the near and the far plane. What an alpha test cuts
    out counts as solid.
    """
    shares = empty_shares(caster, plan.world_from_cam[shown_frames(len(plan))], camera)
    return EmptyPixels(
        share=round(float(shares.mean()), 6),
        worst_frame_share=round(float(shares.max()), 6),
        mostly_empty_frames=round(float(np.mean(shares > MOSTLY)), 6),
    )


def empty_shares(caster: RayCaster, world_from_cam: Array, camera: CameraConfig) -> Array:
    """Share (N,) of the pixels that show nothing, from each of the poses (N, 4, 4)."""
    ray = cell_directions(camera, COLUMNS, ROWS).reshape(-1, 3)  # one metre along the axis
    shares = np.empty(len(world_from_cam))
    for index, pose in enumerate(world_from_cam):
        direction = ray @ pose[:3, :3].T
        start = pose[:3, 3] + camera.near_m * direction
        depth_m = camera.near_m + caster.first_hit_m(start, direction) / np.linalg.norm(ray, axis=1)
        shares[index] = np.mean(depth_m > camera.far_m)
    return shares
