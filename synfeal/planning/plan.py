"""The camera's way through a scene: the cycle of section 3 until there are enough frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import Box, CollectionConfig, SceneConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.errors import InputError
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.mesh.checks import check_sampling_box
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import load_collision_mesh
from synfeal.planning.path import path_poses
from synfeal.planning.sampling import pose_bounds, sample_poses
from synfeal.planning.start import sample_start
from synfeal.planning.target import admissible, select_target

Array = NDArray[np.float64]


def plan_scene(
    collision: Path,
    scene: SceneConfig,
    collection: CollectionConfig,
    n_frames: int,
    rng: np.random.Generator,
) -> PoseTable:
    """Plan one split of a scene from its collision mesh; see :func:`plan_split`."""
    vertices, faces = load_collision_mesh(collision)
    mesh_bounds = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    box = sampling_box_of(scene, mesh_bounds, str(collision))
    return plan_split(RayCaster(vertices, faces), box, scene, collection, n_frames, rng)


def sampling_box_of(scene: SceneConfig, mesh_bounds_m: Array, name: str) -> Array:
    """The configured sampling box (2, 3), or the mesh's bounds (2, 3) as in the paper.

    Raises:
        InputError: the configured box contradicts the mesh; the message starts with ``name``.
    """
    if scene.sampling_box is None:
        return mesh_bounds_m
    box = box_array(scene.sampling_box)
    check_sampling_box(box, mesh_bounds_m, name)
    return box


def box_array(box: Box) -> Array:
    """Lower and upper corner (2, 3) of a configured box, metres."""
    return np.array([box.x, box.y, box.z], dtype=np.float64).T


def plan_split(
    caster: RayCaster,
    box: Array,
    scene: SceneConfig,
    collection: CollectionConfig,
    n_frames: int,
    rng: np.random.Generator,
) -> PoseTable:
    """Poses of ``n_frames`` frames along connected straight paths; the last path may be cut short.

    Args:
        caster: rays against the collision mesh.
        box: (2, 3) lower and upper corner of the space camera centres are sampled in, metres.
        scene: angle bounds and least view distance.
        collection: candidates, frame spacing, least path length, interpolation.
        n_frames: frames wanted, at least 1.
        rng: the only source of randomness.

    Raises:
        InputError: no frames wanted, or no admissible pose found; says what to relax.
    """
    if n_frames < 1:
        raise InputError(f"plan: {n_frames} frames asked for; at least 1 is needed")
    bounds = pose_bounds(box, scene.angles)
    view_m, max_tries = scene.min_view_distance_m, collection.max_tries
    start = sample_start(caster, bounds, view_m, max_tries, rng)  # itself no frame
    paths: list[Array] = []
    while sum(map(len, paths)) < n_frames:
        target = next_target(caster, start, bounds, scene, collection, rng)
        spacing = collection.frame_spacing_m
        paths.append(path_poses(start, target, spacing, collection.interpolation))
        start = target
    return _table(paths, n_frames)


def next_target(
    caster: RayCaster,
    start: Array,
    bounds: Array,
    scene: SceneConfig,
    collection: CollectionConfig,
    rng: np.random.Generator,
) -> Array:
    """The target (6,) of the path from ``start``: candidates are drawn until one is admissible."""
    for _ in range(collection.max_tries):
        poses = sample_poses(bounds, collection.candidates, rng)
        fit = admissible(caster, start, poses, scene.min_view_distance_m)
        target = select_target(start, poses, fit, collection.min_path_m)
        if target is not None:
            return target
    where = ", ".join(f"{value:.2f}" for value in start[:3])
    raise InputError(
        f"plan: no admissible target from ({where}) in {collection.max_tries} rounds of"
        f" {collection.candidates} candidates; lower min_path_m ({collection.min_path_m} m) or"
        f" min_view_distance_m ({scene.min_view_distance_m} m), or widen sampling_box"
    )


def _table(paths: list[Array], n_frames: int) -> PoseTable:
    """The first ``n_frames`` poses of consecutive paths (n, 4, 4)."""
    poses = np.concatenate(paths)[:n_frames]
    index = np.repeat(np.arange(len(paths)), [len(path) for path in paths])[:n_frames]
    return PoseTable(np.arange(n_frames), index, poses[:, :3, 3].copy(), quat_wxyz_of(poses))
