"""Placement of objects on flat surfaces of a scene, touching nothing.

An object stands upright on what lies flat below it, turned at random. Its bounding box meets no
triangle of the scene, by the separating-axis test of Akenine-Möller (Fast 3D triangle-box overlap
testing, JGT 6(1), 2001), and keeps its distance from paths.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster

Array = NDArray[np.float64]
Standing = tuple[list[MeshPart], dict[str, Any]]  # an object, and where it stands, for manifests
CLUTTER = "clutter.json"  # beside the mesh: which objects stand about in it, and where
CLEARANCE_M = 0.002  # between an object and what it stands on
FLAT_M = 0.008  # what it stands on may differ by at the corners
PATH_CLEARANCE_M = 0.25  # between an object and a camera that passes


def standing(
    kinds: Sequence[tuple[str, TexturedMesh]],
    count: int,
    corners: Array,
    bounds_m: Array,
    rng: np.random.Generator,
    tries: int,
    path_m: Array | None = None,
) -> Iterator[Standing | None]:
    """Yield placed objects one by one, none touching another; None for each without a place.

    Args:
        kinds: Objects by name, taken in turn.
        count: Number of objects to place.
        corners: Corners (N, 3, 3), world, metres, of the triangles that objects stand on.
        bounds_m: Lower and upper corner (2, 3) of the space they are let down from.
        rng: Source of the places.
        tries: Places tried for each object.
        path_m: Positions (P, 3) of a camera, in order; objects keep off its way.
    """
    ground = Ground(corners, path_m)
    for number in range(count):
        name, kind = kinds[number % len(kinds)]
        found = ground.place(kind, bounds_m, rng, tries)
        if found is None:
            yield None
            continue
        foot_m, yaw_rad = found
        lower, upper = kind.bounds_m
        middle = np.array([*(lower + upper)[:2] / 2, lower[2]])
        parts = [
            replace(
                part,
                name=f"object-{number}",
                vertices_m=(part.vertices_m - middle) @ _about_z(yaw_rad).T + foot_m,
            )
            for part in kind.parts
        ]
        corners = np.concatenate([corners, *(part.vertices_m[part.faces] for part in parts)])
        ground = Ground(corners, path_m)
        place = {"position_m": foot_m.round(4).tolist(), "yaw_deg": round(np.degrees(yaw_rad), 2)}
        yield parts, {"name": name, **place, "size_m": (upper - lower).round(4).tolist()}


def refuse_larger(size_m: Array, mesh: TexturedMesh, what: str) -> None:
    """Refuse an object that does not fit into the bounds of a scene, however it is turned.

    Args:
        size_m: Size (3,) of the object along its own axes, metres.
        mesh: The scene.
        what: What messages call the object.
    """
    if (np.sort(size_m) > np.sort(np.ptp(mesh.bounds_m, axis=0))).any():
        shown = " x ".join(f"{side:.3g}" for side in size_m)
        raise InputError(f"{what} is {shown} m, larger than the scene; check its unit")


class Ground:
    """Surface that objects stand on, and must not touch."""

    def __init__(self, corners: Array, path_m: Array | None) -> None:
        """Prepare the surface; the arguments are those of :func:`standing`."""
        self._corners = corners
        index = np.arange(3 * len(corners)).reshape(-1, 3)
        self._caster = RayCaster(corners.reshape(-1, 3), index)
        path_m = np.zeros((0, 3)) if path_m is None else path_m
        # The path, or its only position, as triangles (P - 1, 3, 3) without an area.
        ends_m = path_m[1:] if len(path_m) > 1 else path_m
        self._steps = np.stack([path_m[: len(ends_m)], ends_m, ends_m], axis=1)

    def place(
        self, kind: TexturedMesh, bounds_m: Array, rng: np.random.Generator, tries: int
    ) -> tuple[Array, float] | None:
        """Find a place for an object, let down from a random position.

        Args:
            kind: The object, in its own frame.
            bounds_m: Lower and upper corner (2, 3) of the space it is let down from, world, metres.
            rng: Source of positions and headings.
            tries: Number of positions tried.

        Returns:
            Where the centre of its base stands (3,), world, metres, and its heading about z,
            radians; None if no try succeeds.
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
            if not meets_box(self._corners, centre_m, half_m, yaw_rad).any():
                return foot_m, yaw_rad
        return None


def _about_z(yaw_rad: float) -> Array:
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def meets_box(corners: Array, centre_m: Array, half: Array, yaw_rad: float) -> NDArray[np.bool_]:
    """Mark the triangles that meet a box turned about z, its inside included.

    By the separating-axis theorem.

    Args:
        corners: Corners (N, 3, 3) of the triangles, world, metres.
        centre_m: Centre (3,) of the box.
        half: Half of its extents (3,), metres.
        yaw_rad: Its turn about z.

    Returns:
        Marks (N,).
    """
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
