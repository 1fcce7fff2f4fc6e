"""Which poses there are in a mesh, and which are admissible: sections 3.1 and 3.2 of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import Angles, SceneConfig
from synfeal.mesh.rays import RayCaster

# A pose as the paper writes it: (x, y, z, roll, pitch, yaw), metres and radians.
PoseVectors = NDArray[np.float64]


def pose_bounds(box_m: NDArray[np.float64], angles: Angles) -> NDArray[np.float64]:
    """Least and greatest value (2, 6) of each element of a pose vector; ``box_m`` is (2, 3)."""
    intervals = (angles.roll_deg, angles.pitch_deg, angles.yaw_deg)
    angle_bounds = np.deg2rad(np.array(intervals, dtype=np.float64).T)
    return np.hstack([np.asarray(box_m, dtype=np.float64), angle_bounds])


def sample_poses(bounds: NDArray[np.float64], count: int, rng: np.random.Generator) -> PoseVectors:
    """Pose vectors (count, 6), every element uniform and independent (Eq. 1)."""
    return rng.uniform(bounds[0], bounds[1], (count, 6))


def view_directions(poses: PoseVectors) -> NDArray[np.float64]:
    """Unit vectors (N, 3) along the optical axes of pose vectors (N, 6), in the world.

    The third column of :func:`synfeal.geometry.rotations.rotation_from_rpy`; roll turns about it.
    """
    pitch, yaw = poses[:, 4], poses[:, 5]
    level = np.cos(pitch)
    return np.stack([level * np.cos(yaw), level * np.sin(yaw), -np.sin(pitch)], axis=1)


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


@dataclass(frozen=True)
class PoseSpace:
    """The poses of one sampling box in a mesh."""

    caster: RayCaster  # rays against the mesh
    bounds: NDArray[np.float64]  # (2, 6) least and greatest value of each element of a pose vector
    min_view_distance_m: float  # least free view, the paper's ``d``
    rng: np.random.Generator  # where samples come from; each takes the next numbers

    @classmethod
    def of_scene(
        cls,
        caster: RayCaster,
        box_m: NDArray[np.float64],
        scene: SceneConfig,
        rng: np.random.Generator,
    ) -> Self:
        """Of a box (2, 3), with the angles and the view distance of a scene."""
        return cls(caster, pose_bounds(box_m, scene.angles), scene.min_view_distance_m, rng)

    def sample(self, count: int) -> PoseVectors:
        """Pose vectors (count, 6), uniform within the bounds."""
        return sample_poses(self.bounds, count, self.rng)

    def has_free_view(self, poses: PoseVectors) -> NDArray[np.bool_]:
        """Which poses (N, 6) look far enough, (N,)."""
        return has_free_view(self.caster, poses, self.min_view_distance_m)
