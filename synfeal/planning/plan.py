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
from synfeal.planning.candidates import CandidateStream
from synfeal.planning.independent import independent_poses
from synfeal.planning.path import path_poses, poses_of
from synfeal.planning.repeat import repeated_poses
from synfeal.planning.sampling import pose_bounds
from synfeal.planning.start import sample_start

Array = NDArray[np.float64]


def plan_scene(
    collision: Path,
    scene: SceneConfig,
    collection: CollectionConfig,
    n_frames: int,
    rng: np.random.Generator,
    split: str = "train",
) -> PoseTable:
    """Plan one split of a scene from its collision mesh; see :func:`plan_split`."""
    vertices, faces = load_collision_mesh(collision)
    mesh_bounds = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    box = sampling_box_of(scene, mesh_bounds, str(collision))
    return plan_split(RayCaster(vertices, faces), box, scene, collection, n_frames, rng, split)


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
    split: str = "train",
) -> PoseTable:
    """Poses of ``n_frames`` frames of a split, as ``collection.mode`` says.

    ``path``: connected straight paths; the last may be cut short. ``random``: independent
    admissible poses, each a path of its own. ``repeat``: the poses of an earlier data set.

    Args:
        caster: rays against the collision mesh.
        box: (2, 3) lower and upper corner of the space camera centres are sampled in, metres.
        scene: angle bounds and least view distance.
        collection: mode, candidates, frame spacing, least path length, interpolation.
        n_frames: frames wanted, at least 1.
        rng: the only source of randomness; not used to repeat.
        split: ``train`` or ``test``; which poses to repeat.

    Raises:
        InputError: no frames wanted; no admissible pose found, which says what to relax; or the
            poses to repeat cannot be read or are too few.
    """
    if n_frames < 1:
        raise InputError(f"plan: {n_frames} frames asked for; at least 1 is needed")
    if collection.repeat is not None:
        return repeated_poses(collection.repeat, split, n_frames, caster.bounds_m)
    bounds = pose_bounds(box, scene.angles)
    if collection.mode == "random":
        view_m = scene.min_view_distance_m
        vectors = independent_poses(caster, bounds, view_m, collection, n_frames, rng)
        return _table(list(poses_of(vectors)[:, None]), n_frames)
    return _table(_paths(caster, bounds, scene, collection, n_frames, rng), n_frames)


def _paths(
    caster: RayCaster,
    bounds: Array,
    scene: SceneConfig,
    collection: CollectionConfig,
    n_frames: int,
    rng: np.random.Generator,
) -> list[Array]:
    """Poses (n, 4, 4) of consecutive paths that have at least ``n_frames`` between them."""
    view_m, max_tries = scene.min_view_distance_m, collection.max_tries
    start = sample_start(caster, bounds, view_m, max_tries, rng)  # itself no frame
    stream = CandidateStream(caster, bounds, collection.candidates, view_m, rng)
    paths: list[Array] = []
    n_planned = 0
    while n_planned < n_frames:
        target = stream.next_target(start, collection.min_path_m, max_tries)
        if target is None:
            raise InputError(_no_target(start, scene, collection))
        spacing = collection.frame_spacing_m
        paths.append(path_poses(start, target, spacing, collection.interpolation))
        n_planned += len(paths[-1])
        start = target
    return paths


def _no_target(start: Array, scene: SceneConfig, collection: CollectionConfig) -> str:
    """What to relax when no path leads on from ``start`` (6,)."""
    where = ", ".join(f"{value:.2f}" for value in start[:3])
    return (
        f"plan: no admissible target from ({where}) in {collection.max_tries} rounds of"
        f" {collection.candidates} candidates; lower min_path_m ({collection.min_path_m} m) or"
        f" min_view_distance_m ({scene.min_view_distance_m} m), or widen sampling_box"
    )


def _table(paths: list[Array], n_frames: int) -> PoseTable:
    """The first ``n_frames`` poses of consecutive paths (n, 4, 4)."""
    poses = np.concatenate(paths)[:n_frames]
    index = np.repeat(np.arange(len(paths)), [len(path) for path in paths])[:n_frames]
    return PoseTable(np.arange(n_frames), index, poses[:, :3, 3].copy(), quat_wxyz_of(poses))
