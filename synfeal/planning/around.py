"""Poses around those of photographs: the simulator's mode ``around``.

A place is photographed from where one can stand. Of the box around a corridor's photographs that is
a small part, so frames spread over the box mostly show what no photograph will. Here cameras stay
within a radius of the photographs, in the open: a free line joins each with the photograph that it
is placed by, so that none gets behind a wall.

Most look about where that photograph looked, the rest anywhere within the bounds of all angles: who
comes back along a corridor photographs it from the other end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from synfeal.errors import InputError
from synfeal.planning.like import rpy_of
from synfeal.planning.space import PoseSpace, PoseVectors, drawn_until

Array = NDArray[np.float64]

# Share of the cameras that look anywhere.
LOOK_ANYWHERE = 0.25
# Photographs near a place that a camera there may be placed by.
NEIGHBOURS = 16
BLOCK = 4096  # candidates drawn at once


class Reach(NamedTuple):
    """Farthest that a camera may be from the photograph that it is placed by.

    Attributes:
        radius_m: In position.
        turn_deg: In orientation, unless it looks anywhere.
    """

    radius_m: float
    turn_deg: float


class _Positions:
    """Positions within a radius of photographs, uniform over that space."""

    def __init__(self, photographs_m: Array, radius_m: float) -> None:
        self._radius_m = radius_m
        self._tree = cKDTree(photographs_m)
        # Cells of this edge that a ball around a photograph can reach into.
        own = np.unique(np.floor(photographs_m / radius_m).astype(np.int64), axis=0)
        beside = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        self._cells = np.unique((own[:, None] + beside).reshape(-1, 3), axis=0)

    def draw(self, count: int, rng: np.random.Generator) -> tuple[Array, NDArray[np.int64]]:
        """Draw up to ``count`` positions (n, 3), and a photograph (n,) within reach of each."""
        cell = self._cells[rng.integers(len(self._cells), size=count)]
        points = (cell + rng.random((count, 3))) * self._radius_m
        choice = rng.random(count)
        n_nearest = min(NEIGHBOURS, self._tree.n)
        distance_m, nearest = self._tree.query(points, k=np.arange(1, n_nearest + 1))
        n_near = (distance_m <= self._radius_m).sum(axis=1)
        inside = n_near > 0
        chosen = (choice * n_near).astype(np.int64)[inside]
        return points[inside], nearest[inside][np.arange(len(chosen)), chosen]


def poses_around(
    space: PoseSpace, photographs: Array, reach: Reach, n_frames: int, max_tries: int
) -> PoseVectors:
    """Draw poses near those of photographs; a shorter plan is a prefix of a longer one.

    Args:
        space: What is asked of views, the bounds of the angles, and where numbers come from; its
            box is not used.
        photographs: Poses ``world_from_cam`` (P, 4, 4) in the world of the mesh.
        reach: How far cameras may be from them.
        n_frames: Number of poses.
        max_tries: Blocks of candidates in a row without an admissible pose, at most.

    Returns:
        Pose vectors (n_frames, 6).

    Raises:
        InputError: ``max_tries`` blocks in a row had no admissible pose.
    """
    positions = _Positions(photographs[:, :3, 3], reach.radius_m)

    def draw() -> PoseVectors:
        place_m, by = positions.draw(BLOCK, space.rng)
        angles = rpy_of(_turned(photographs[by, :3, :3], reach.turn_deg, space.rng))
        anywhere = space.rng.random(len(by)) < LOOK_ANYWHERE
        angles[anywhere] = space.sample(len(by))[anywhere, 3:]
        poses = np.hstack([place_m, angles])[space.caster.sees(photographs[by, :3, 3], place_m)]
        return poses[space.has_free_view(poses)]

    def refusal(_: int) -> InputError:
        return InputError(
            "plan",
            f"no pose within {reach.radius_m:g} m of the photographs looks farther than"
            f" `min_view_distance_m` ({space.min_view_distance_m} m){space.also_asked}",
            "lower it, or check that the photographs are of this mesh",
        )

    return drawn_until(n_frames, draw, max_tries, refusal)


def _turned(rotation: Array, most_deg: float, rng: np.random.Generator) -> Array:
    """Turn rotations (N, 3, 3), each about an axis of its own, by up to ``most_deg``."""
    axis = rng.standard_normal((len(rotation), 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle_rad = np.deg2rad(most_deg) * rng.random((len(rotation), 1))
    return np.asarray(rotation @ Rotation.from_rotvec(axis * angle_rad).as_matrix())
