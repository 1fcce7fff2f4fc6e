"""Where objects can stand in a scene: on what lies flat, touching nothing.

An object stands upright on what lies flat below it, turned at random. Its bounding box meets no
triangle of the scene, by the separating-axis test of Akenine-Möller (Fast 3D triangle-box overlap
testing, JGT 6(1), 2001), and keeps its distance from paths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster

Array = NDArray[np.float64]
CLEARANCE_M = 0.002  # between an object and what it stands on
FLAT_M = 0.008  # what it stands on may differ by at the corners
PATH_CLEARANCE_M = 0.25  # between an object and a camera that passes


@dataclass(frozen=True)
class Ground:
    """What objects stand on, and must not touch."""

    corners: Array  # (N, 3, 3) of its triangles
    path_m: Array | None = None  # (P, 3) positions that a camera passes one after the other

    @cached_property
    def _caster(self) -> RayCaster:
        count = len(self.corners)
        return RayCaster(self.corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))

    @cached_property
    def _steps(self) -> Array:
        """The path, or its only position, as triangles (P - 1, 3, 3) without an area."""
        path_m = np.zeros((0, 3)) if self.path_m is None else self.path_m
        ends_m = path_m[1:] if len(path_m) > 1 else path_m
        return np.stack([path_m[: len(ends_m)], ends_m, ends_m], axis=1)

    def place(
        self, kind: TexturedMesh, bounds_m: Array, rng: np.random.Generator, tries: int
    ) -> tuple[Array, float] | None:
        """Where an object can stand (3,), and how it is turned; None after so many tries.

        It is let down from a random place between the corners ``bounds_m`` (2, 3).
        """
        half_m = np.ptp(kind.bounds_m, axis=0) / 2
        base = np.array([(x, y, 0.0) for x in (-1, 0, 1) for y in (-1, 0, 1)]) * half_m
        down = np.tile([0.0, 0.0, -1.0], (9, 1))
        for _ in range(tries):
            start_m = rng.uniform(bounds_m[0], bounds_m[1])
            yaw_rad = float(rng.uniform(0, 2 * np.pi))
            above = base @ _about_z(yaw_rad).T + start_m
            height_m = above[:, 2] - self._caster.first_hit_m(above, down)
            if not np.isfinite(height_m).all() or np.ptp(height_m) > FLAT_M:
                continue
            foot_m = np.array([*start_m[:2], height_m.max() + CLEARANCE_M])
            centre_m = foot_m + np.array([0.0, 0.0, half_m[2]])
            if meets_box(self._steps, centre_m, half_m + PATH_CLEARANCE_M, yaw_rad).any():
                continue
            if not meets_box(self.corners, centre_m, half_m, yaw_rad).any():
                return foot_m, yaw_rad
        return None


def moved(kind: TexturedMesh, foot_m: Array, yaw_rad: float, name: str) -> list[MeshPart]:
    """An object with the middle of its bottom at a place, turned."""
    lower, upper = kind.bounds_m
    middle = np.array([*(lower + upper)[:2] / 2, lower[2]])
    turn = _about_z(yaw_rad)
    return [
        replace(part, name=name, vertices_m=(part.vertices_m - middle) @ turn.T + foot_m)
        for part in kind.parts
    ]


def described(name: str, kind: TexturedMesh, foot_m: Array, yaw_rad: float) -> dict[str, Any]:
    """Where an object stands, for the manifest."""
    return {
        "name": name,
        "position_m": foot_m.round(4).tolist(),
        "yaw_deg": round(np.degrees(yaw_rad), 2),
        "size_m": np.ptp(kind.bounds_m, axis=0).round(4).tolist(),
    }


def _about_z(yaw_rad: float) -> Array:
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def meets_box(
    corners: Array, centre_m: Array, half_m: Sequence[float] | Array, yaw_rad: float
) -> NDArray[np.bool_]:
    """Which triangles (N, 3, 3) meet a box that is turned about z, its inside included: (N,)."""
    half = np.asarray(half_m, np.float64)
    corners = (corners - centre_m) @ _about_z(yaw_rad)
    meets = ((corners.min(axis=1) <= half) & (corners.max(axis=1) >= -half)).all(axis=1)
    near = corners[meets]
    sides = np.roll(near, -1, axis=1) - near
    axes = [np.cross(sides[:, 0], sides[:, 1])]
    axes += [np.cross(unit, sides[:, side]) for unit in np.eye(3) for side in range(3)]
    still = np.ones(len(near), bool)
    for axis in axes:
        along = np.einsum("nij,nj->ni", near, axis)
        reach = np.abs(axis) @ half
        still &= (along.min(axis=1) <= reach) & (along.max(axis=1) >= -reach)
    meets[meets] = still
    return np.asarray(meets)
