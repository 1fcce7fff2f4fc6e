"""Coverage of a plan: how much of the free space, of the surface, and how much of nothing."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from synfeal.camera.projection import (
    cell_directions,
    depth_of_points,
    is_shown,
    pixels_of_points,
)
from synfeal.config.collection import SceneConfig
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, load_collision_mesh
from synfeal.planning.plan import sampling_boxes_of
from synfeal.planning.space import ConnectedSpace, PoseSpace, connected_space, pose_bounds
from synfeal.records.files import write_json

Array = NDArray[np.float64]

N_POINTS = 20_000  # a share of one half is then known to 0.4 % (standard error)
MAX_FRAMES = 1_000
OFTEN = 3  # frames
FARTHEST_M = 5.0
LIFT_M = 0.01  # rays stop this far in front of the surface they are to reach
COLUMNS, ROWS = 16, 12  # rays of a frame: its share is then known to a few per cent
MOSTLY = 0.5  # share of a frame
VOXEL_M, WITHIN_VOXELS = 0.25, 2.0
MAX_VOXELS = 20_000  # in larger boxes voxels are larger
N_HEADINGS = 8
MAX_TRIES = 2000
DEFINITIONS = {
    "voxels": "cells of the sampling boxes, of edge voxel_m, whose centre lies in the largest space"
    " connected by free lines of sight",
    "positions_share": "share of the voxels with a camera centre within within_m of theirs",
    "headings_share": f"share of the pairs of a voxel and one of {N_HEADINGS} equal sectors of"
    " heading for which a camera within within_m of the centre looks into that sector",
    "visible_share": "share of the whole surface, by area, that can be seen from the free space",
    "seen_share": "share of the visible surface in at least one frame: projected into the image,"
    " not hidden, no farther than farthest_m; of frames_looked_at frames spread evenly",
    "seen_often_share": f"the same, in at least {OFTEN} of these frames",
    "empty_pixels": "rays of frames_looked_at frames that meet nothing between the near and the"
    " far plane: share of all, of those of the emptiest frame, and share of the frames of which"
    f" more than {MOSTLY:.0%} is empty",
    "surface_points": "points, uniform over the surface, the shares of the surface are counted on",
}


class SeenSurface(NamedTuple):
    """Counts of surface points."""

    visible: int  # those that can be seen from the free space at all
    seen: int  # how many of them at least one frame shows
    seen_often: int  # how many of them at least ``OFTEN`` frames show


def seen_surface(
    mesh: Triangles, caster: RayCaster, hubs_m: Array, plan: PoseTable, camera: CameraConfig
) -> SeenSurface:
    """Count the points of a mesh's surface that can be seen, and those that a plan's frames see.

    ``N_POINTS`` points are drawn uniformly over the surface. A point is in a frame if it is
    projected into the image, no farther than ``FARTHEST_M``, and nothing is in front of it. Either
    side of a surface counts: scans have holes, and walls without thickness.

    Args:
        mesh: The mesh.
        caster: Rays against it.
        hubs_m: Places (H, 3) in the free space, world, metres. A point that none of them sees
            cannot be seen.
        plan: Poses of the frames; at most ``MAX_FRAMES`` are looked at, spread evenly.
        camera: Camera of the frames.
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
    """Return indices of at most ``MAX_FRAMES`` frames, spread evenly over all."""
    return np.linspace(0, n_frames - 1, min(n_frames, MAX_FRAMES)).round().astype(np.int64)


def visible_points(caster: RayCaster, places_m: Array, points_m: Array) -> Array:
    """Return those of the surface points (N, 3) that at least one place (P, 3) sees."""
    found = np.zeros(len(points_m), dtype=np.bool_)
    for place in places_m:
        left = np.flatnonzero(~found)
        found[left] = has_line(caster, place, points_m[left])
    return points_m[found]


def has_line(caster: RayCaster, place_m: Array, points_m: Array) -> NDArray[np.bool_]:
    """Mark surface points (N, 3) with nothing between them and a place (3,): (N,)."""
    towards = place_m - points_m
    length_m = np.linalg.norm(towards, axis=1, keepdims=True)
    lifted = points_m + towards * np.minimum(LIFT_M / np.maximum(length_m, LIFT_M), 1.0)
    return caster.sees(np.broadcast_to(place_m, lifted.shape), lifted)


def in_image(camera: CameraConfig, world_from_cam: Array, points_m: Array) -> NDArray[np.bool_]:
    """Mark points (N, 3) within ``FARTHEST_M`` that a pose (4, 4) projects into the image: (N,)."""
    offset = points_m - world_from_cam[:3, 3]
    at = offset @ world_from_cam[:3, :3]
    reached = np.einsum("ni,ni->n", at, at) <= FARTHEST_M**2
    inside: NDArray[np.bool_] = reached & (depth_of_points(camera, at) > camera.near_m)
    inside[inside] = is_shown(camera, pixels_of_points(camera, at[inside]))
    return inside


@dataclass(frozen=True)
class EmptyPixels:
    """Shares of a plan's frames that show nothing."""

    share: float  # share of all pixels
    worst_frame_share: float  # share of the emptiest frame's pixels
    mostly_empty_frames: float  # share of the frames of which more than half is empty


def empty_pixels(caster: RayCaster, plan: PoseTable, camera: CameraConfig) -> EmptyPixels:
    """Measure how much of a plan's frames shows nothing, by a grid of rays through each.

    A pixel is empty where nothing is between the near and the far plane. What an alpha test cuts
    out counts as solid.

    Args:
        caster: Rays against the mesh.
        plan: Poses of at least one frame; at most ``MAX_FRAMES`` are looked at, spread evenly.
        camera: Camera of the frames, with its near and far plane.
    """
    shares = empty_shares(caster, plan.world_from_cam[shown_frames(len(plan))], camera)
    return EmptyPixels(
        share=round(float(shares.mean()), 6),
        worst_frame_share=round(float(shares.max()), 6),
        mostly_empty_frames=round(float(np.mean(shares > MOSTLY)), 6),
    )


def empty_shares(caster: RayCaster, world_from_cam: Array, camera: CameraConfig) -> Array:
    """Measure the share (N,) of the image that shows nothing from each of the poses (N, 4, 4)."""
    ray = cell_directions(camera, COLUMNS, ROWS).reshape(-1, 3)  # at depth 1
    n_rays = len(ray)
    ray = ray[np.isfinite(ray).all(axis=1)]  # a fisheye may show nothing in its corners
    shares = np.empty(len(world_from_cam))
    for index, pose in enumerate(world_from_cam):
        direction = ray @ pose[:3, :3].T
        start = pose[:3, 3] + camera.near_m * direction
        depth_m = camera.near_m + caster.first_hit_m(start, direction) / np.linalg.norm(ray, axis=1)
        shares[index] = 1.0 - np.sum(depth_m <= camera.far_m) / n_rays
    return shares


def plan_coverage(
    mesh: Triangles, boxes_m: Array, scene: SceneConfig, plan: PoseTable, camera: CameraConfig
) -> dict[str, object]:
    """Measure a plan's coverage, as the content of ``coverage.json``; see ``DEFINITIONS``.

    Args:
        mesh: The scene or its collision mesh.
        boxes_m: Corners (B, 2, 3), or (2, 3) for one, of the boxes that camera centres are sampled
            in, world, metres.
        scene: Settings of the scene.
        plan: Poses of the plan.
        camera: Camera of the frames.
    """
    caster = RayCaster(*mesh)
    boxes_m = np.reshape(boxes_m, (-1, 2, 3))
    sampled = [
        PoseSpace(caster, pose_bounds(box_m, scene.angles), 0.0, np.random.default_rng(0))
        for box_m in boxes_m
    ]
    try:
        hubs_m = [connected_space(space, MAX_TRIES).hubs_m for space in sampled]
        space = ConnectedSpace(caster, np.concatenate(hubs_m))
    except InputError:  # poses that are repeated may lie where none can be sampled
        space = ConnectedSpace(caster, plan.position_m[shown_frames(len(plan))])
    counts = seen_surface(mesh, caster, space.hubs_m, plan, camera)
    visible = max(counts.visible, 1)
    return {
        "frames": len(plan),
        "free_space": free_space_coverage(space, boxes_m, plan),
        "surface": {
            "farthest_m": FARTHEST_M,
            "frames_looked_at": len(shown_frames(len(plan))),
            "surface_points": N_POINTS,
            "visible_share": counts.visible / N_POINTS,
            "seen_share": counts.seen / visible,
            "seen_often_share": counts.seen_often / visible,
        },
        "empty_pixels": asdict(empty_pixels(caster, plan, camera)),
        "definitions": DEFINITIONS,
    }


def scene_coverage(
    collision: Path, scene: SceneConfig, plan: PoseTable, camera: CameraConfig
) -> dict[str, object]:
    """Measure a plan's coverage of a collision mesh; see :func:`plan_coverage`."""
    mesh = load_collision_mesh(collision)
    mesh_bounds = np.stack([mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)])
    boxes = sampling_boxes_of(scene, mesh_bounds, str(collision))
    return plan_coverage(mesh, boxes, scene, plan, camera)


def free_space_coverage(
    space: ConnectedSpace, boxes_m: Array, plan: PoseTable
) -> dict[str, float | None]:
    """Measure how much of the free space, and of the headings in it, a plan's cameras cover.

    Args:
        space: The free space.
        boxes_m: Lower and upper corners (B, 2, 3) of the sampling boxes, world, metres; (2, 3) for
            one.
        plan: Poses of the cameras.

    Returns:
        What ``coverage.json`` holds under ``free_space``, see ``DEFINITIONS``; shares are None
        where no voxel is free.
    """
    cells = [voxel_centres(box_m) for box_m in np.reshape(boxes_m, (-1, 2, 3))]
    centres, edge_m = np.concatenate([found for found, _ in cells]), max(edge for _, edge in cells)
    centres = centres[space.contains(centres)]
    within_m = WITHIN_VOXELS * edge_m
    heading = headings(plan)
    covered = np.zeros((N_HEADINGS, len(centres)), dtype=np.bool_)
    for sector in range(N_HEADINGS):
        cameras = plan.position_m[heading == sector]
        if len(cameras) and len(centres):
            covered[sector] = cKDTree(cameras).query(centres)[0] <= within_m
    return {
        "voxel_m": round(edge_m, 6),
        "voxels": len(centres),
        "within_m": round(within_m, 6),
        "positions_share": float(covered.any(axis=0).mean()) if len(centres) else None,
        "headings_share": float(covered.mean()) if len(centres) else None,
    }


def voxel_centres(box_m: Array) -> tuple[Array, float]:
    """Divide a box into cells about :data:`VOXEL_M` wide, at most about :data:`MAX_VOXELS`.

    Args:
        box_m: Lower and upper corner (2, 3), world, metres.

    Returns:
        The centres (N, 3) of the cells, world, metres, and the edge aimed at, metres; cells are
        stretched a little along each axis so that they fill the box.
    """
    side_m = box_m[1] - box_m[0]
    edge_m = max(VOXEL_M, float(np.cbrt(np.prod(side_m) / MAX_VOXELS)))
    count = np.maximum(np.round(side_m / edge_m), 1).astype(np.int64)
    axes = [
        box_m[0, axis] + (np.arange(n) + 0.5) * side_m[axis] / n for axis, n in enumerate(count)
    ]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return centres, edge_m


def headings(plan: PoseTable) -> NDArray[np.int64]:
    """Return the sector (N,) of each camera's horizontal heading; 0 starts at world x."""
    forward = plan.world_from_cam[:, :3, 2]
    turn = np.arctan2(forward[:, 1], forward[:, 0]) / (2.0 * np.pi)
    return np.asarray(np.floor(turn * N_HEADINGS) % N_HEADINGS, dtype=np.int64)


def write_coverage(
    collision: Path, scene: SceneConfig, plan: Path, camera: CameraConfig, out_coverage: Path
) -> None:
    """Write what a plan covers as JSON; see :func:`plan_coverage`."""
    write_json(out_coverage, scene_coverage(collision, scene, read_pose_table(plan), camera))
