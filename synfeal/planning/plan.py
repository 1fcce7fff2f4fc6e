"""The camera's way through a scene: the cycle of section 3 until there are enough frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collection import Box, CollectionConfig, SceneConfig
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.errors import InputError
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.mesh.checks import check_sampling_box
from synfeal.mesh.clearance import Clearance
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, load_collision_mesh
from synfeal.planning.around import Reach, poses_around
from synfeal.planning.like import photograph_poses
from synfeal.planning.path import CandidateStream, independent_poses, path_poses, poses_of
from synfeal.planning.repeat import repeated_poses
from synfeal.planning.space import PoseSpace, sample_start

Array = NDArray[np.float64]
MOST_DEAD_ENDS = 100  # targets in a row that lead nowhere; then the place itself is one
MOST_OF_PATH = 10**6  # frames: the whole path is planned, however few of it are asked for


def write_plan(
    collision: Path,
    scene: SceneConfig,
    collection: CollectionConfig,
    n_frames: int,
    seed: int,
    split: str,
    out_plan: Path,
) -> None:
    """Plan one split of a scene; see :func:`plan_split`.

    Args:
        collision: Collision mesh of the scene.
        scene: Settings of the scene; :func:`sampling_boxes_of` says where cameras may be.
        collection: How paths are planned.
        n_frames: Number of frames.
        seed: Seed of this plan's random numbers.
        split: ``train`` or ``test``.
        out_plan: Pose table to write.
    """
    table = plan_mesh(
        mesh=load_collision_mesh(collision),
        name=str(collision),
        scene=scene,
        collection=collection,
        n_frames=n_frames,
        rng=np.random.default_rng(seed),
        split=split,
    )
    write_pose_table(out_plan, table)


def plan_mesh(
    mesh: Triangles,
    name: str,
    scene: SceneConfig,
    collection: CollectionConfig,
    n_frames: int,
    rng: np.random.Generator,
    split: str,
) -> PoseTable:
    """Plan one split in a collision mesh, called ``name`` in messages; see :func:`plan_split`."""
    caster = RayCaster(*mesh)
    boxes = sampling_boxes_of(scene, caster.bounds_m, name)
    clearance = Clearance(*mesh, scene.min_clearance_m) if scene.min_clearance_m > 0 else None
    return plan_split(caster, boxes, scene, collection, n_frames, rng, split, clearance)


def sampling_boxes_of(scene: SceneConfig, mesh_bounds_m: Array, name: str) -> Array:
    """Return the boxes that camera centres are sampled in.

    Args:
        scene: Settings of the scene, with the boxes if any are configured.
        mesh_bounds_m: Lower and upper corner (2, 3) of the mesh, world, metres: the box where none
            is configured, as in the paper.
        name: What messages call the mesh.

    Returns:
        Lower and upper corners (B, 2, 3), world, metres.
    """
    if scene.sampling_box is None:
        return mesh_bounds_m[None]
    boxes = np.stack([box_array(box) for box in (scene.sampling_box, *scene.further_boxes)])
    for box in boxes:
        check_sampling_box(box, mesh_bounds_m, name)
    return boxes


def sampling_box_of(scene: SceneConfig, mesh_bounds_m: Array, name: str) -> Array:
    """Return the box (2, 3) around all of :func:`sampling_boxes_of`."""
    boxes = sampling_boxes_of(scene, mesh_bounds_m, name)
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def box_array(box: Box) -> Array:
    """Return the lower and upper corner (2, 3) of a configured box, metres."""
    return np.array([box.x, box.y, box.z], dtype=np.float64).T


def plan_split(
    caster: RayCaster,
    boxes: Array,
    scene: SceneConfig,
    collection: CollectionConfig,
    n_frames: int,
    rng: np.random.Generator,
    split: str = "train",
    clearance: Clearance | None = None,
) -> PoseTable:
    """Plan the poses of a split by ``collection.mode``.

    ``path``: connected straight paths; the last may be cut short. Where ``collection.test_paths``
    asks for more paths than whole ones would give, the test split takes every k-th frame of whole
    paths. ``random``: independent admissible poses, each a path of its own. ``around``: such poses
    near those of photographs, wherever the boxes are. ``repeat``: the poses of an earlier data set.
    Every box has paths of its own, and frames in proportion to its volume
    in every prefix of the plan.

    Args:
        caster: Rays against the collision mesh.
        boxes: Lower and upper corners (B, 2, 3), or (2, 3) for one box, of the spaces that camera
            centres are sampled in, world, metres.
        scene: Angle bounds and least view distance.
        collection: Mode, candidates, frame spacing, least path length, interpolation.
        n_frames: Number of frames, at least 1.
        rng: The only source of randomness; unused where poses are repeated.
        split: ``train`` or ``test``: which poses to repeat.
        clearance: Distance that cameras keep from surfaces, if any; not checked for poses that
            are repeated.

    Raises:
        InputError: no frames wanted; no admissible pose found, which says what to relax; or the
            poses to repeat cannot be read or are too few.
    """
    if n_frames < 1:
        raise InputError("plan", f"{n_frames} frames asked for; at least 1 is needed")
    boxes = np.reshape(boxes, (-1, 2, 3))
    if collection.mode == "around":
        space = PoseSpace.of_scene(caster, boxes[0], scene, rng, clearance)
        vectors = _around(space, scene.path, collection, n_frames)
        return _pose_table(poses_of(vectors), np.arange(n_frames))
    if collection.repeat is not None:
        return repeated_poses(collection.repeat, split, n_frames, caster.bounds_m)
    longest_m = float(np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1).max())
    if collection.mode == "path" and collection.frame_spacing_m > longest_m:
        raise InputError(
            "plan",
            f"the frame spacing ({collection.frame_spacing_m:g} m) is longer than any path in the"
            f" sampling box ({longest_m:.3g} m across)",
            "lower it",
        )
    if collection.mode == "path" and longest_m / collection.frame_spacing_m > MOST_OF_PATH:
        raise InputError(
            "plan",
            f"a path across the sampling box ({longest_m:.3g} m) would have more than"
            f" {MOST_OF_PATH} frames",
            f"raise the frame spacing ({collection.frame_spacing_m:g} m), or give another `unit_m`",
        )
    # One generator for each box, so that none shifts another's numbers.
    generators = [rng] if len(boxes) == 1 else rng.spawn(len(boxes))
    spaces = [
        PoseSpace.of_scene(caster, box, scene, own, clearance)
        for box, own in zip(boxes, generators, strict=True)
    ]
    if collection.mode == "random":
        vectors = _independent(spaces, _Turns(boxes), collection, n_frames)
        return _pose_table(poses_of(vectors), np.arange(n_frames))
    n_paths = collection.test_paths if split == "test" else None
    return _thinned(_paths(spaces, _Turns(boxes), collection), n_frames, n_paths or 0)


def _independent(
    spaces: Sequence[PoseSpace], turns: _Turns, collection: CollectionConfig, n_frames: int
) -> Array:
    """Draw pose vectors (n_frames, 6) from the spaces in turns."""
    owner = np.array([turns.next(1) for _ in range(n_frames)])
    vectors = np.empty((n_frames, 6))
    for index, space in enumerate(spaces):
        count = int((owner == index).sum())
        if count:
            vectors[owner == index] = independent_poses(space, collection, count)
    return vectors


def _around(
    space: PoseSpace, mesh: Path | None, collection: CollectionConfig, n_frames: int
) -> Array:
    """Draw pose vectors (n_frames, 6) near the photographs of a mesh."""
    sequence, radius_m, turn_deg = (
        collection.repeat,
        collection.around_m,
        collection.around_turn_deg,
    )
    if sequence is None or radius_m is None or turn_deg is None:  # which the model refuses
        raise ValueError("mode `around` without photographs")
    photographs, reach = photograph_poses(mesh, sequence), Reach(radius_m, turn_deg)
    return poses_around(space, photographs, reach, n_frames, collection.max_tries)


def _paths(
    spaces: Sequence[PoseSpace], turns: _Turns, collection: CollectionConfig
) -> Iterator[Array]:
    """Yield whole paths (n, 4, 4) without end, each in the space whose turn it is."""
    walks = [_walk(space, collection) for space in spaces]
    while True:
        index = turns.next(0)
        path = next(walks[index])
        turns.made[index] += len(path)
        yield path


def _thinned(paths: Iterator[Array], n_frames: int, n_paths: int) -> PoseTable:
    """Tabulate every k-th frame of whole paths, with the smallest k that reaches enough of them.

    Frames are counted through all paths, so that none favours where paths begin or end: those are
    waypoints, which lie nearer to the faces of the box than the frames between.

    Args:
        paths: Poses (n, 4, 4) of one path after another.
        n_frames: Number of frames to return.
        n_paths: Least number of paths they are to be of; 0 asks for none, and gives all frames.
    """
    taken: list[Array] = []
    total = 0
    every, least = 1, min(n_paths, n_frames)
    while True:
        while total < every * n_frames or len(taken) < least:
            taken.append(next(paths))
            total += len(taken[-1])
        path = np.repeat(np.arange(len(taken)), [len(one) for one in taken])[::every][:n_frames]
        if len(np.unique(path)) >= least:
            return _pose_table(np.concatenate(taken)[::every][:n_frames], path)
        every = max(every + 1, total // n_frames)


class _Turns:
    """Chooses the box of the next frames: the one that lacks most of its share by volume."""

    def __init__(self, boxes: Array) -> None:
        volume = np.prod(boxes[:, 1] - boxes[:, 0], axis=1)
        self._share = volume / volume.sum()
        self.made = np.zeros(len(boxes))

    @property
    def total(self) -> int:
        """Frames made so far."""
        return int(self.made.sum())

    def next(self, n_frames: int) -> int:
        """Return the index of the next box, and count ``n_frames`` as made in it."""
        index = int(np.argmax(self._share * (self.total + 1) - self.made))
        self.made[index] += n_frames
        return index


def _walk(space: PoseSpace, collection: CollectionConfig) -> Iterator[Array]:
    """Yield poses (n, 4, 4) of connected paths through one box: each begins where one ended.

    A path is taken once another is known to lead on from its end. The paper does not say what
    happens where none does: beside a table leg nearly every straight way is blocked, and a camera
    that has flown there would stay there. Another target is chosen instead.
    """
    stream = CandidateStream(space, collection.candidates, collection.frame_spacing_m)

    def target_from(start: Array) -> Array | None:
        return stream.next_target(start, collection.min_path_m, collection.max_tries)

    at = sample_start(space, collection.max_tries)  # itself no frame
    target = target_from(at)
    if target is None:
        raise _stuck(at, space, collection)
    dead_ends = 0
    while dead_ends < MOST_DEAD_ENDS:
        onward = None if target is None else target_from(target)
        if target is None or onward is None:
            target, dead_ends = target_from(at), dead_ends + 1
        else:
            yield path_poses(at, target, collection.frame_spacing_m, collection.interpolation)
            at, target, dead_ends = target, onward, 0
    raise _stuck(at, space, collection)


def _stuck(at: Array, space: PoseSpace, collection: CollectionConfig) -> InputError:
    """Return the error that no path leads on from a pose vector (6,)."""
    where = ", ".join(f"{value:.2f}" for value in at[:3])
    return InputError(
        "plan",
        f"no admissible target from ({where}) in {collection.max_tries} rounds of"
        f" {collection.candidates} candidates",
        f"lower `min_path_m` ({collection.min_path_m} m) or `min_view_distance_m`"
        f" ({space.min_view_distance_m} m){_or_clearance(space)}, or widen the sampling box",
    )


def _or_clearance(space: PoseSpace) -> str:
    """Name the clearance among what may be lowered, if there is one."""
    if space.clearance is None:
        return ""
    return f" or `min_clearance_m` ({space.clearance.min_clearance_m} m)"


def _pose_table(poses: Array, path: NDArray[np.int64]) -> PoseTable:
    """Tabulate poses (n, 4, 4) by the index (n,) of the path that each is of."""
    return PoseTable(np.arange(len(poses)), path, poses[:, :3, 3].copy(), quat_wxyz_of(poses))
