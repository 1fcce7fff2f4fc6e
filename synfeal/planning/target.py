"""Target pose selection: section 3.2 of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.rays import RayCaster
from synfeal.planning.sampling import PoseVectors, view_directions


def has_free_view(
    caster: RayCaster, poses: PoseVectors, min_view_distance_m: float
) -> NDArray[np.bool_]:
    """Whether what each pose (N, 6) looks at is farther than the paper's ``d``, (N,).

    Clarification of the paper: a view ray that hits nothing has an infinite length and would pass
    ``R > d``. It looks out through a hole of the mesh, at an image without information, which is
    what the criterion is there to prevent; so a hit is required.
    """
    distance = caster.first_hit_m(poses[:, :3], view_directions(poses))
    return np.asarray((distance > min_view_distance_m) & np.isfinite(distance), dtype=np.bool_)


def admissible(
    caster: RayCaster, start: NDArray[np.float64], poses: PoseVectors, min_view_distance_m: float
) -> NDArray[np.bool_]:
    """Which candidates (N, 6) a free line from ``start`` reaches and have a free view, (N,).

    ``start`` is one pose vector (6,) for all of them or one for each (N, 6).
    This is the set X_a of section 3.2: ``R(p_i, p_c) > |p_i - p_c|`` and ``R(p_c, p_c) > d``.
    """
    starts = np.broadcast_to(start[..., :3], (len(poses), 3))
    reachable = caster.sees(starts, poses[:, :3])
    return reachable & has_free_view(caster, poses, min_view_distance_m)


def select_target(
    start: NDArray[np.float64],
    poses: PoseVectors,
    is_admissible: NDArray[np.bool_],
    min_path_m: float,
) -> NDArray[np.float64] | None:
    """The admissible candidate (6,) farthest from ``start``; None if none is ``min_path_m`` away.

    The least length is the published collector's: a path of a few centimetres adds no new view.
    """
    distance = np.linalg.norm(poses[:, :3] - start[:3], axis=1)
    distance = np.where(is_admissible, distance, -1.0)
    farthest = int(np.argmax(distance))
    return poses[farthest] if distance[farthest] >= max(min_path_m, 0.0) else None
