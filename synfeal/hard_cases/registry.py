"""The hard cases of the simulator, in the order of the table; a new one is a line in its module."""

from __future__ import annotations

from synfeal.hard_cases import (
    collision,
    depth,
    far_poses,
    interpolation,
    medians,
    noise,
    ray_casting,
    rotations,
)

CASES = (
    *rotations.CASES,
    *interpolation.CASES,
    *far_poses.CASES,
    *ray_casting.CASES,
    *collision.CASES,
    *depth.CASES,
    *noise.CASES,
    *medians.CASES,
)
