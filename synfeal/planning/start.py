"""The space the scene is about, where in it the first path starts, and what is asked of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from synfeal.config.models import SceneConfig
from synfeal.errors import InputError
from synfeal.mesh.rays import RayCaster
from synfeal.planning.space import PoseSpace, PoseVectors, admissible

N_POSES = 64


def sample_start(space: PoseSpace, max_tries: int) -> NDArray[np.float64]:
    """A pose vector (6,) with a free view in the largest free part of a space.

    The paper does not say where the camera starts. Inside a cupboard it would stay there, since
    every path must be free of collisions. Normals cannot tell inside from outside in a scan, but
    visibility can: the start is one of the largest group of poses that see each other.
    """
    start: NDArray[np.float64] = largest_group(space, max_tries, N_POSES)[0]
    return start


def largest_group(space: PoseSpace, max_tries: int, n_poses: int) -> PoseVectors:
    """The largest group (M, 6) among ``n_poses`` sampled poses with a free view.

    Those that see each other are joined. Samples are uniform in volume, so the group is in the
    largest space connected by free lines.

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
            f"plan: no pose in the sampling box looks farther than min_view_distance_m"
            f" ({space.min_view_distance_m} m); lower it, or check sampling_box, unit_m and up_axis"
        )
    group = seeing_groups(space.caster, found[:, :3])
    largest: PoseVectors = found[group == np.bincount(group).argmax()]
    return largest


def seeing_groups(caster: RayCaster, places_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number (N,) of the group of each place (N, 3); free lines of sight connect a group."""
    i, j = np.triu_indices(len(places_m), k=1)
    free = caster.sees(places_m[i], places_m[j]) if len(i) else np.empty(0, np.bool_)
    graph = coo_array((np.ones(int(free.sum())), (i[free], j[free])), shape=(len(places_m),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


N_CONNECTED = 256  # enough that a free place that sees none of their largest group is a rare nook


@dataclass(frozen=True)
class ConnectedSpace:
    """The largest free space of a scene, as what can be seen from places in it."""

    caster: RayCaster  # rays against the mesh
    hubs_m: NDArray[np.float64]  # (H, 3) places connected to each other by free lines of sight

    def contains(self, points_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether a free line joins each point (N, 3) to one of the hubs, (N,)."""
        found = np.zeros(len(points_m), dtype=np.bool_)
        for hub in self.hubs_m:
            left = np.flatnonzero(~found)
            if not len(left):
                break
            ends = points_m[left]
            found[left] = self.caster.sees(np.broadcast_to(hub, ends.shape), ends)
        return found


def connected_space(space: PoseSpace, max_tries: int) -> ConnectedSpace:
    """The space in which :func:`synfeal.planning.start.sample_start` starts a path."""
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
        """Which candidates (N,) are admissible in the mesh of ``caster``."""
        return admissible(caster, self.starts, self.candidates, self.min_view_distance_m)


def draw_questions(
    caster: RayCaster,  # rays against the undecimated mesh
    scene: SceneConfig,  # angle bounds and least view distance
    box_m: NDArray[np.float64],  # (2, 3) lower and upper corner of the space that is sampled
    rng: np.random.Generator,  # the only source of randomness
    # number of questions; all are independent of each other but for the first pose
    count: int = N_QUESTIONS,
) -> Questions:
    """Questions that planners of a scene would ask: the last candidates of ``count`` short walks.

    Each walk leaves the planner's first pose and goes to every admissible candidate it draws, so a
    start is always an admissible pose: no question starts in a cupboard or outside the room.
    """
    space = PoseSpace.of_scene(caster, box_m, scene, rng)
    starts = np.tile(sample_start(space, MAX_TRIES), (count, 1))
    for _ in range(N_MOVES):
        candidates = space.sample(count)
        moves = admissible(caster, starts, candidates, scene.min_view_distance_m)
        starts[moves] = candidates[moves]
    return Questions(starts, space.sample(count), scene.min_view_distance_m)
