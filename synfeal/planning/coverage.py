"""What a plan covers, kept on record: how much of the free space and of the surface."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from synfeal.config.models import CameraConfig, SceneConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.files import write_json
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, load_collision_mesh
from synfeal.planning.plan import sampling_boxes_of
from synfeal.planning.seen_surface import (
    FARTHEST_M,
    MOSTLY,
    OFTEN,
    empty_pixels,
    seen_surface,
    shown_frames,
)
from synfeal.planning.seen_surface import N_POINTS as N_SURFACE_POINTS
from synfeal.planning.space import PoseSpace, pose_bounds
from synfeal.planning.start import ConnectedSpace, connected_space

Array = NDArray[np.float64]

VOXEL_M = 0.25
MAX_VOXELS = 20_000  # in larger boxes voxels are larger
WITHIN_VOXELS = 2.0
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


def plan_coverage(
    mesh: Triangles, boxes_m: Array, scene: SceneConfig, plan: PoseTable, camera: CameraConfig
) -> dict[str, object]:
    """What a plan covers, as the content of ``coverage.json``; see ``DEFINITIONS``.

    ``mesh`` is the scene or its collision mesh, ``boxes_m`` (B, 2, 3) or (2, 3) the corners of the
    spaces that camera centres are sampled in.
    """
    caster = RayCaster(*mesh)
    boxes_m = np.reshape(boxes_m, (-1, 2, 3))
    try:
        space = ConnectedSpace(caster, np.concatenate([_hubs(caster, b, scene) for b in boxes_m]))
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
            "surface_points": N_SURFACE_POINTS,
            "visible_share": counts.visible / N_SURFACE_POINTS,
            "seen_share": counts.seen / visible,
            "seen_often_share": counts.seen_often / visible,
        },
        "empty_pixels": asdict(empty_pixels(caster, plan, camera)),
        "definitions": DEFINITIONS,
    }


def _hubs(caster: RayCaster, box_m: Array, scene: SceneConfig) -> Array:
    """Places (H, 3) of the largest free space in a box."""
    bounds, rng = pose_bounds(box_m, scene.angles), np.random.default_rng(0)
    return connected_space(PoseSpace(caster, bounds, 0.0, rng), MAX_TRIES).hubs_m


def scene_coverage(
    collision: Path, scene: SceneConfig, plan: PoseTable, camera: CameraConfig
) -> dict[str, object]:
    """What a plan covers of the scene of a collision mesh; see :func:`plan_coverage`."""
    mesh = load_collision_mesh(collision)
    mesh_bounds = np.stack([mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)])
    boxes = sampling_boxes_of(scene, mesh_bounds, str(collision))
    return plan_coverage(mesh, boxes, scene, plan, camera)


def free_space_coverage(
    space: ConnectedSpace, boxes_m: Array, plan: PoseTable
) -> dict[str, float | None]:
    """Which voxels of the connected space in the boxes (B, 2, 3) have cameras near them.

    See ``DEFINITIONS``.
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
    """Centres (N, 3) of cells that fill a box (2, 3), and the edge they have on average."""
    side_m = box_m[1] - box_m[0]
    edge_m = max(VOXEL_M, float(np.cbrt(np.prod(side_m) / MAX_VOXELS)))
    count = np.maximum(np.round(side_m / edge_m), 1).astype(np.int64)
    axes = [
        box_m[0, axis] + (np.arange(n) + 0.5) * side_m[axis] / n for axis, n in enumerate(count)
    ]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return centres, edge_m


def headings(plan: PoseTable) -> NDArray[np.int64]:
    """Sector (N,) of the horizontal direction each camera looks in; 0 starts at world x."""
    forward = plan.world_from_cam[:, :3, 2]
    turn = np.arctan2(forward[:, 1], forward[:, 0]) / (2.0 * np.pi)
    return np.asarray(np.floor(turn * N_HEADINGS) % N_HEADINGS, dtype=np.int64)


def write_coverage(
    collision: Path, scene: SceneConfig, plan: Path, camera: CameraConfig, out_coverage: Path
) -> None:
    """Write what a plan covers as JSON."""
    write_json(out_coverage, scene_coverage(collision, scene, read_pose_table(plan), camera))
