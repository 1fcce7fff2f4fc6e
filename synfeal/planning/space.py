"""Candidate poses in a mesh, and the admissible ones: sections 3.1 and 3.2 of the paper.

And the space the scene is about, which free lines connect: where the first path starts, and what is
asked of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from synfeal.config.collection import Angles, SceneConfig
from synfeal.errors import InputError
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.clearance import Clearance
from synfeal.mesh.rays import RayCaster

Array = NDArray[np.float64]
# A pose as the paper writes it: (x, y, z, roll, pitch, yaw), metres and radians.
PoseVectors = Array


def pose_bounds(box_m: Array, angles: Angles) -> Array:
    """Return lower and upper bounds (2, 6) of pose vectors in a box (2, 3), metres and radians."""
    intervals = (angles.roll_deg, angles.pitch_deg, angles.yaw_deg)
    angle_bounds = np.deg2rad(np.array(intervals, dtype=np.float64).T)
    return np.hstack([np.asarray(box_m, dtype=np.float64), angle_bounds])


def sample_poses(bounds: Array, count: int, rng: np.random.Generator) -> PoseVectors:
    """Draw pose vectors (count, 6), every element uniform and independent (Eq. 1).

    Args:
        bounds: Least and greatest value (2, 6) of each element, metres and radians.
        count: Number of poses.
        rng: Source of the numbers.
    """
    return rng.uniform(bounds[0], bounds[1], (count, 6))


def drawn_until(
    n_frames: int,
    draw: Callable[[], PoseVectors],
    most_empty: int,
    refusal: Callable[[int], InputError],
) -> PoseVectors:
    """Draw admissible poses block by block; fewer of them are a prefix of more.

    Args:
        n_frames: Number of poses.
        draw: Draws a block of candidates, and returns those that are admissible (n, 6).
        most_empty: Blocks in a row without any, from which it gives up.
        refusal: What to raise then, by the number of these blocks.

    Returns:
        Pose vectors (n_frames, 6).
    """
    kept: list[PoseVectors] = []
    n_kept = n_empty = 0
    while n_kept < n_frames:
        kept.append(draw())
        n_kept += len(kept[-1])
        n_empty = 0 if len(kept[-1]) else n_empty + 1
        if n_empty >= most_empty:
            raise refusal(n_empty)
    return np.concatenate(kept)[:n_frames]


def view_directions(poses: PoseVectors) -> Array:
    """Compute unit vectors (N, 3) along the optical axes of pose vectors (N, 6), world.

    The third column of :func:`synfeal.geometry.rotations.rotation_from_rpy`; roll turns about it.
    """
    pitch, yaw = poses[:, 4], poses[:, 5]
    level = np.cos(pitch)
    return np.stack([level * np.cos(yaw), level * np.sin(yaw), -np.sin(pitch)], axis=1)


def has_free_view(
    caster: RayCaster, poses: PoseVectors, min_view_distance_m: float
) -> NDArray[np.bool_]:
    """Mark poses that look at a surface, but at none too near.

    Clarification of the paper: a view ray that hits nothing has an infinite length and would pass
    ``R > d``. It looks out through a hole of the mesh, at an image without information, which is
    what the criterion is there to prevent; so a hit is required.

    Args:
        caster: Rays against the mesh.
        poses: Pose vectors (N, 6).
        min_view_distance_m: Distance along the optical axis that the surface must be farther than.

    Returns:
        Marks (N,).
    """
    distance = caster.first_hit_m(poses[:, :3], view_directions(poses))
    return np.asarray((distance > min_view_distance_m) & np.isfinite(distance), dtype=np.bool_)


# Tangents of the view's half angles, and rays of it: its edge counts, its corners do not.
VIEW_TANGENT, VIEW_RAYS = (np.tan(np.deg2rad(25.0)), np.tan(np.deg2rad(20.0))), (6, 5)


def seen_shares(caster: RayCaster, poses: PoseVectors) -> Array:
    """Measure how much of the view from each pose meets the mesh.

    The view is a pinhole of 50 x 40 degrees, whatever the camera, sampled by 30 rays.

    Args:
        caster: Rays against the mesh.
        poses: Pose vectors (N, 6): position, metres, then roll, pitch and yaw, radians.

    Returns:
        Shares (N,) from 0 to 1; less than 1 where rays leave through a hole of the mesh.
    """
    columns, rows = VIEW_RAYS
    x = ((np.arange(columns) + 0.5) / columns * 2.0 - 1.0) * VIEW_TANGENT[0]
    y = ((np.arange(rows) + 0.5) / rows * 2.0 - 1.0) * VIEW_TANGENT[1]
    rays = np.stack([*np.meshgrid(x, y), np.ones((rows, columns))], axis=-1).reshape(-1, 3)
    turned = np.einsum("nij,rj->nri", rotation_from_rpy(poses[:, 3:]), rays)
    starts = np.broadcast_to(poses[:, None, :3], turned.shape)
    hit_m = caster.first_hit_m(starts.reshape(-1, 3), turned.reshape(-1, 3))
    return np.asarray(np.isfinite(hit_m).reshape(len(poses), -1).mean(axis=1))


def admissible(
    caster: RayCaster, start: Array, poses: PoseVectors, min_view_distance_m: float
) -> NDArray[np.bool_]:
    """Mark candidates with a free view that a free line from ``start`` reaches.

    This is the set X_a of section 3.2: ``R(p_i, p_c) > |p_i - p_c|`` and ``R(p_c, p_c) > d``.

    Args:
        caster: Rays against the collision mesh.
        start: One pose vector (6,) for all candidates, or one for each (N, 6).
        poses: Candidates (N, 6), pose vectors.
        min_view_distance_m: Least free view, the paper's ``d``.

    Returns:
        Marks (N,).
    """
    starts = np.broadcast_to(start[..., :3], (len(poses), 3))
    reachable = caster.sees(starts, poses[:, :3])
    return reachable & has_free_view(caster, poses, min_view_distance_m)


def farthest_admissible(
    caster: RayCaster,
    start: Array,
    rounds: PoseVectors,
    has_view: NDArray[np.bool_],
    min_path_m: float,
    is_clear_way: Callable[[Array], bool] | None = None,
) -> tuple[int, int] | None:
    """Find the first round with an admissible candidate, and the farthest one in it.

    The least length is the published collector's: a path of a few centimetres adds no new view.

    Args:
        caster: Rays against the collision mesh.
        start: Pose vector (6,) that the path starts from.
        rounds: Candidates (R, k, 6), pose vectors, in R rounds.
        has_view: Which candidates (R, k) have a free view, see :func:`has_free_view`.
        min_path_m: Least length of a path, metres.
        is_clear_way: Tells whether the way from the start to a target (6,) is wide enough; None if
            every way is.

    Returns:
        Indices of the round and of the candidate in it; None if no round has an admissible
        candidate at least ``min_path_m`` away.
    """
    length_m = np.linalg.norm(rounds[..., :3] - start[:3], axis=-1)
    fit = has_view & (length_m >= min_path_m)
    ends = rounds[fit, :3]
    fit[fit] = caster.sees(np.broadcast_to(start[:3], ends.shape), ends)
    while fit.any():
        first = int(np.argmax(fit.any(axis=1)))
        farthest = int(np.argmax(np.where(fit[first], length_m[first], -1.0)))
        if is_clear_way is None or is_clear_way(rounds[first, farthest]):
            return first, farthest
        fit[first, farthest] = False
    return None


@dataclass(frozen=True)
class PoseSpace:
    """The poses of one sampling box in a mesh."""

    caster: RayCaster  # rays against the mesh
    bounds: Array  # (2, 6) least and greatest value of each element of a pose vector
    min_view_distance_m: float  # least free view, the paper's ``d``
    rng: np.random.Generator  # where samples come from; each takes the next numbers
    min_seen: float = 0.0  # least share of the view that meets the mesh, see :func:`seen_shares`
    clearance: Clearance | None = None  # distance that cameras keep from surfaces, if any

    @classmethod
    def of_scene(
        cls,
        caster: RayCaster,
        box_m: Array,
        scene: SceneConfig,
        rng: np.random.Generator,
        clearance: Clearance | None = None,
    ) -> Self:
        """Build the space of a box with a scene's angles, view distance and ``min_seen``.

        Args:
            caster: Rays against the mesh.
            box_m: Lower and upper corner (2, 3) of the box, world, metres.
            scene: Settings of the scene.
            rng: Where samples come from.
            clearance: Distance that cameras keep from surfaces; None if they need keep none.
        """
        bounds = pose_bounds(box_m, scene.angles)
        return cls(
            caster=caster,
            bounds=bounds,
            min_view_distance_m=scene.min_view_distance_m,
            rng=rng,
            min_seen=scene.min_seen or 0.0,
            clearance=clearance,
        )

    @property
    def also_asked(self) -> str:
        """Clause on the clearance for messages that no free view was found; may be empty."""
        if self.clearance is None:
            return ""
        return f" and keeps `min_clearance_m` ({self.clearance.min_clearance_m} m) from surfaces"

    def sample(self, count: int) -> PoseVectors:
        """Draw pose vectors (count, 6), uniform within the bounds."""
        return sample_poses(self.bounds, count, self.rng)

    def has_free_view(self, poses: PoseVectors) -> NDArray[np.bool_]:
        """Mark poses (N, 6) whose view is free, shows enough mesh and keeps the clearance: (N,)."""
        good = has_free_view(self.caster, poses, self.min_view_distance_m)
        if self.min_seen > 0.0:
            good[good] = seen_shares(self.caster, poses[good]) >= self.min_seen
        if self.clearance is not None:
            good[good] = self.clearance.keeps(poses[good, :3])
        return good


N_POSES = 64


def sample_start(space: PoseSpace, max_tries: int) -> Array:
    """Draw a pose vector (6,) with a free view in the largest free part of a space.

    The paper does not say where the camera starts. Inside a cupboard it would stay there, since
    every path must be free of collisions. Normals cannot tell inside from outside in a scan, but
    visibility can: the start is one of the largest group of poses that see each other.
    """
    return np.asarray(largest_group(space, max_tries, N_POSES)[0])


def largest_group(space: PoseSpace, max_tries: int, n_poses: int) -> PoseVectors:
    """Find the largest group of sampled poses that see each other, directly or through others.

    Samples are uniform in volume, so the group is in the largest space connected by free lines.

    Args:
        space: Where poses are sampled.
        max_tries: Rounds of ``n_poses`` samples, at most.
        n_poses: Poses with a free view that are looked for; once there are as many, no further
            round is drawn.

    Returns:
        Pose vectors (M, 6) of the group.

    Raises:
        InputError: ``max_tries`` rounds gave no pose with a free view; says what to relax.
    """
    found = np.empty((0, 6))
    for _ in range(max_tries):
        poses = space.sample(n_poses)
        found = np.vstack([found, poses[space.has_free_view(poses)]])
        if len(found) >= n_poses:
            break
    if not len(found):
        raise InputError(
            "plan",
            "no pose in the sampling box looks farther than `min_view_distance_m`"
            f" ({space.min_view_distance_m} m){space.also_asked}",
            "lower it, or check the box, `unit_m` and `up_axis`",
        )
    group = seeing_groups(space.caster, found[:, :3])
    largest: PoseVectors = found[group == np.bincount(group).argmax()]
    return largest


def seeing_groups(caster: RayCaster, places_m: Array) -> NDArray[np.int64]:
    """Label places (N, 3) by group (N,): free lines of sight connect those of one group."""
    i, j = np.triu_indices(len(places_m), k=1)
    free = caster.sees(places_m[i], places_m[j]) if len(i) else np.empty(0, np.bool_)
    graph = coo_array((np.ones(int(free.sum())), (i[free], j[free])), shape=(len(places_m),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


N_CONNECTED = 256  # enough that a free place that sees none of their largest group is a rare nook


@dataclass(frozen=True)
class ConnectedSpace:
    """The largest free space of a scene, as what can be seen from places in it."""

    caster: RayCaster  # rays against the mesh
    hubs_m: Array  # (H, 3) places connected to each other by free lines of sight

    def contains(self, points_m: Array) -> NDArray[np.bool_]:
        """Mark points (N, 3) that a free line joins to one of the hubs: (N,)."""
        found = np.zeros(len(points_m), dtype=np.bool_)
        for hub in self.hubs_m:
            left = np.flatnonzero(~found)
            if not len(left):
                break
            ends = points_m[left]
            found[left] = self.caster.sees(np.broadcast_to(hub, ends.shape), ends)
        return found


def connected_space(space: PoseSpace, max_tries: int) -> ConnectedSpace:
    """Find the space in which :func:`synfeal.planning.space.sample_start` starts a path."""
    return ConnectedSpace(space.caster, largest_group(space, max_tries, N_CONNECTED)[:, :3])


N_QUESTIONS = 10_000
RAYS_EACH = 2  # one to the candidate, one along its optical axis
N_MOVES = 12  # after these a walk no longer remembers where it began
MAX_TRIES = 2000


@dataclass(frozen=True)
class Questions:
    """Candidates (N, 6), each to be judged from a start of its own (N, 6)."""

    starts: PoseVectors
    candidates: PoseVectors
    min_view_distance_m: float

    @property
    def n_rays(self) -> int:
        """Rays cast to answer all of them."""
        return RAYS_EACH * len(self.candidates)

    def answers(self, caster: RayCaster) -> NDArray[np.bool_]:
        """Mark candidates (N,) that are admissible in the mesh of ``caster``."""
        return admissible(caster, self.starts, self.candidates, self.min_view_distance_m)


def draw_questions(
    caster: RayCaster,
    scene: SceneConfig,
    box_m: Array,
    rng: np.random.Generator,
    count: int = N_QUESTIONS,
) -> Questions:
    """Draw the questions that a scene's planner would ask: the last candidates of short walks.

    Each walk leaves the planner's first pose and goes to every admissible candidate it draws, so a
    start is always an admissible pose: no question starts in a cupboard or outside the room.

    Args:
        caster: Rays against the undecimated mesh.
        scene: Angle bounds and least view distance.
        box_m: Lower and upper corner (2, 3) of the space that is sampled, world, metres.
        rng: The only source of randomness.
        count: Number of walks and of questions, which are independent but for the first pose.
    """
    space = PoseSpace.of_scene(caster, box_m, scene, rng)
    starts = np.tile(sample_start(space, MAX_TRIES), (count, 1))
    for _ in range(N_MOVES):
        candidates = space.sample(count)
        moves = admissible(caster, starts, candidates, scene.min_view_distance_m)
        starts[moves] = candidates[moves]
    return Questions(starts, space.sample(count), scene.min_view_distance_m)
