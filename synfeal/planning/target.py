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


def farthest_admissible(
    caster: RayCaster,  # rays against the collision mesh
    start: NDArray[np.float64],  # where the path starts, (6,)
    rounds: PoseVectors,  # (R, k, 6) rounds of candidates
    has_view: NDArray[np.bool_],  # (R, k) which have a free view, see :func:`has_free_view`
    min_path_m: float,  # least length of a path
) -> tuple[int, int] | None:
    """Index of the first round with an admissible candidate, and there of the farthest.

    None if no round has an admissible candidate at least ``min_path_m`` from ``start`` (6,). The
    least length is the published collector's: a path of a few centimetres adds no new view.
    """
    length_m = np.linalg.norm(rounds[..., :3] - start[:3], axis=-1)
    fit = has_view & (length_m >= min_path_m)
    ends = rounds[fit, :3]
    fit[fit] = caster.sees(np.broadcast_to(start[:3], ends.shape), ends)
    if not fit.any():
        return None
    first = int(np.argmax(fit.any(axis=1)))
    return first, int(np.argmax(np.where(fit[first], length_m[first], -1.0)))
