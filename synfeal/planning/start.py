"""Where the first path starts: a pose in the space the scene is about."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from synfeal.errors import InputError
from synfeal.mesh.rays import RayCaster
from synfeal.planning.sampling import PoseVectors
from synfeal.planning.space import PoseSpace

N_POSES = 64


def sample_start(space: PoseSpace, max_tries: int) -> NDArray[np.float64]:
    """A pose vector (6,) with a free view in the largest free part of a space.

    The paper does not say where the camera starts. Inside a cupboard it would stay there, since
    every path must be free of collisions. Normals cannot tell inside from outside in a scan, but
    visibility can: the start is one of the largest group of poses that see each other.

    Raises:
        InputError: ``max_tries`` rounds gave no pose with a free view; says what to relax.
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
