"""Light baked into textures: lamps and sun with shadows, and indirect light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reproduction.rooms.scan import RoomSurface
from synfeal.mesh.rays import RayCaster
from synfeal.objects.canvas import Color

Vectors = NDArray[np.float32]
LIFT_M = 0.015  # rays start this far in front of their surface
REACH_M = 1.5  # how far away something still darkens the ambient light
N_SKY_RAYS = 40
N_BOUNCES = 3
CHUNK = 1 << 14
MEDIAN_LIGHT = 0.62  # what the median surface receives after exposure; 1 shows the bare albedo
GLOW = 1.2  # radiance of a surface that shines by itself


@dataclass(frozen=True)
class Lamp:
    """A small source that shines around ``axis`` (unit) with a cosine, like a panel or a window.

    ``group`` says what it is switched with.
    """

    position_m: tuple[float, float, float]
    axis: tuple[float, float, float]
    color: Color
    group: Literal["lamps", "daylight"] = "lamps"


@dataclass(frozen=True)
class Sun:
    """Parallel light of ``direction`` that enters through rectangles, given by opposite corners.

    Every rectangle is axis-aligned: one of the three coordinates is the same in both corners.
    """

    direction: tuple[float, float, float]
    color: Color
    openings: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...]


@dataclass(frozen=True)
class Lighting:
    """All light of a scene."""

    lower_m: tuple[float, float, float]  # corners of the space the ambient light is given for
    upper_m: tuple[float, float, float]  # corners of the space the ambient light is given for
    # (2, 2, 2, 3) ambient light at its corners by x, y, z; linear in between
    ambient: NDArray[np.float32]
    lamps: Sequence[Lamp]  # local sources
    sun: Sun | None  # sunlight through openings, if any

    def ambient_at(self, points: Vectors) -> Vectors:
        """Return ambient light (N, 3) at points (N, 3)."""
        lower, upper = _single(self.lower_m), _single(self.upper_m)
        share = np.clip((points - lower) / (upper - lower), 0, 1)
        value = self.ambient.astype(np.float32)[None]
        for axis in range(3):
            along = share[:, axis].reshape(-1, *[1] * (value.ndim - 2))
            value = value[:, 0] * (1 - along) + value[:, 1] * along
        return np.asarray(value, np.float32)

    def of_group(self, group: str) -> Lighting:
        """Keep one group of ``LIGHT_GROUPS``; all of them add up to the whole."""
        return replace(
            self,
            ambient=self.ambient if group == "ambient" else np.zeros_like(self.ambient),
            lamps=[lamp for lamp in self.lamps if lamp.group == group],
            sun=self.sun if group == "daylight" else None,
        )


def _single(values: ArrayLike) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)


def baked(
    surface: RoomSurface, albedo: Vectors, glow: NDArray[np.float32], lighting: Lighting
) -> Vectors:
    """Compute what display-referred albedo is multiplied by to show a surface in its light.

    Args:
        surface: Surface of V vertices.
        albedo: Linear albedo (V, 3).
        glow: Light (V,) that vertices give off.
        lighting: Sources of light.

    Returns:
        Factors (V, 3), after exposure and display gamma; see :func:`received`.
    """
    light = received(surface, albedo, glow, lighting)
    exposed = light * exposure_of(light)
    return np.asarray(exposed ** np.float32(1 / 2.2), np.float32)


def exposure_of(light: Vectors) -> np.float32:
    """Choose the factor on light (V, 3) that a scene is shown with."""
    return np.float32(MEDIAN_LIGHT / np.median(light))


def received(
    surface: RoomSurface, albedo: Vectors, glow: NDArray[np.float32], lighting: Lighting
) -> Vectors:
    """Compute the light that arrives at a surface; the sum of what every source alone gives.

    The surface receives, blocks and passes it on.

    Args:
        surface: Surface of V vertices.
        albedo: Linear albedo (V, 3).
        glow: Light (V,) that vertices give off, see :class:`synfeal.objects.patches.Patch`.
        lighting: Sources of light.

    Returns:
        Linear light (V, 3).
    """
    caster = RayCaster(surface.points_m, surface.faces)
    normals = surface.normals.astype(np.float32)
    origins = surface.inner_m.astype(np.float32) + np.float32(LIFT_M) * normals
    openness, hits = _gather_rays(caster, origins, normals)
    first = lighting.ambient_at(origins + normals) * openness[:, None]
    for lamp in lighting.lamps:
        first += _lamp_light(lamp, origins, normals, caster)
    if lighting.sun is not None:
        first += _sun_light(lighting.sun, origins, normals, caster)
    light = first
    for _ in range(N_BOUNCES):
        radiance = albedo * light + np.float32(GLOW) * glow[:, None] * albedo
        light = first + _gathered(radiance[surface.faces].mean(axis=1), hits)
    return light


def _gather_rays(
    caster: RayCaster, origins: Vectors, normals: Vectors
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Cast cosine-distributed rays: openness (N,) and the faces (N, K) hit, −1 for none.

    Openness is the mean free length of the rays up to ``REACH_M``, floored at one fifth.
    """
    total = np.zeros(len(origins), np.float32)
    hits = np.empty((len(origins), N_SKY_RAYS), np.int32)
    for index, direction in enumerate(_sky_directions(normals)):
        free, hits[:, index] = caster.first_hits(origins, direction)
        total += np.minimum(free / REACH_M, 1).astype(np.float32)
    return np.asarray(0.2 + 0.8 * total / N_SKY_RAYS, np.float32), hits


def _sky_directions(normals: Vectors) -> list[Vectors]:
    """Return K directions (N, 3), cosine-distributed around each normal by one pattern."""
    index = np.arange(N_SKY_RAYS) + 0.5
    radius, angle = np.sqrt(index / N_SKY_RAYS), index * np.pi * (3 - np.sqrt(5))
    helper = np.where(np.abs(normals[:, 2:]) < 0.9, _single([0, 0, 1]), _single([1, 0, 0]))
    side = np.cross(normals, helper)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-6)
    other = np.cross(normals, side)
    return [
        _single(r * np.cos(a) * side + r * np.sin(a) * other + np.sqrt(1 - r * r) * normals)
        for r, a in zip(radius, angle, strict=True)
    ]


def _gathered(radiance: Vectors, hits: NDArray[np.int32]) -> Vectors:
    """Average the radiance (N, 3) of the faces each point's rays hit; the outside is dark."""
    padded = np.concatenate([radiance, np.zeros((1, 3), np.float32)])  # where −1 points to
    chunks = (hits[start : start + CHUNK] for start in range(0, len(hits), CHUNK))
    return np.concatenate([padded[chunk].mean(axis=1) for chunk in chunks])


def _lamp_light(lamp: Lamp, origins: Vectors, normals: Vectors, caster: RayCaster) -> Vectors:
    towards = _single(lamp.position_m) - origins
    distance = np.maximum(np.linalg.norm(towards, axis=1), np.float32(1e-3))
    facing = np.sum(towards * normals, axis=1) / distance
    leaving = -towards @ _single(lamp.axis) / distance
    strength = np.clip(facing, 0, 1) * np.clip(leaving, 0, 1) / (distance**2 + np.float32(0.15))
    reached = np.flatnonzero(strength > 1e-3)
    # A lamp hangs in or behind the panel that stands for it, so the last stretch does not count.
    visible = caster.sees(origins[reached], origins[reached] + 0.94 * towards[reached])
    light = np.zeros((len(origins), 3), np.float32)
    light[reached] = (strength[reached] * visible)[:, None] * _single(lamp.color)
    return light


def _sun_light(sun: Sun, origins: Vectors, normals: Vectors, caster: RayCaster) -> Vectors:
    towards = -_single(sun.direction) / np.float32(np.linalg.norm(sun.direction))
    strength = np.clip(normals @ towards, 0, 1)
    light = np.zeros((len(origins), 3), np.float32)
    for lower, upper in sun.openings:
        low, high = np.minimum(lower, upper), np.maximum(lower, upper)
        axis = int(np.argmin(high - low))
        travel = (np.float32(low[axis]) - origins[:, axis]) / towards[axis]
        at = origins + travel[:, None] * towards
        others = [other for other in range(3) if other != axis]
        inside = np.all((at[:, others] > low[others]) & (at[:, others] < high[others]), axis=1)
        lit = np.flatnonzero(inside & (travel > 0) & (strength > 0))
        # The window itself is a surface of the mesh; what is in front of it blocks the light.
        reach = np.maximum(travel[lit] - 0.12, 0)[:, None]
        visible = caster.sees(origins[lit], origins[lit] + reach * towards)
        light[lit] += (strength[lit] * visible)[:, None] * _single(sun.color)
    return light


def ambient_corners(
    near_left: Color, far_left: Color, near_right: Color, far_right: Color, top: float
) -> NDArray[np.float32]:
    """Compute the ambient light at the corners of a room from that at the corners of its floor.

    Args:
        near_left: Linear light at the floor's corner of low y and low x.
        far_left: The same at high y and low x.
        near_right: The same at low y and high x.
        far_right: The same at high y and high x.
        top: Factor of the light at the ceiling over that at the floor.

    Returns:
        Ambient light (2, 2, 2, 3), by x, y and z.
    """
    floor = np.array([[near_left, far_left], [near_right, far_right]], np.float32)
    return np.stack([floor, np.float32(top) * floor], axis=2)
