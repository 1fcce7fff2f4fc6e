"""Light that is baked into the textures: lamps and sun with shadows, sky light with occlusion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synfeal.scenes.canvas import Colour
from synfeal.scenes.patches import Block

Vectors = NDArray[np.float32]
LIFT_M = 0.015  # rays start this far in front of their surface
N_SKY_RAYS = 14


@dataclass(frozen=True)
class Lamp:
    """A small source that shines around ``axis`` (unit) with a cosine, like a panel or a window."""

    position_m: tuple[float, float, float]
    axis: tuple[float, float, float]
    colour: Colour


@dataclass(frozen=True)
class Sun:
    """Parallel light of ``direction`` that enters through rectangles, given by opposite corners.

    Every rectangle is axis-aligned: one of the three coordinates is the same in both corners.
    """

    direction: tuple[float, float, float]
    colour: Colour
    openings: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...]


@dataclass(frozen=True)
class Lighting:
    """All light of a scene.

    Attributes:
        lower_m, upper_m: corners of the space the ambient light is given for.
        ambient: (2, 2, 2, 3) ambient light at its corners by x, y, z; linear in between.
        lamps: local sources.
        sun: sunlight through openings, if any.
        shell: blocks outside of the room that darken its corners but let the sun in.
        reach_m: how far away something still darkens the ambient light.
    """

    lower_m: tuple[float, float, float]
    upper_m: tuple[float, float, float]
    ambient: NDArray[np.float32]
    lamps: Sequence[Lamp]
    sun: Sun | None
    shell: Sequence[Block]
    reach_m: float = 1.0

    def tone(self, points_m: Vectors, normals: Vectors, blocks: Sequence[Block]) -> Vectors:
        """Factors (N, 3) on display-referred albedo at surface points (N, 3)."""
        origins = points_m + np.float32(LIFT_M) * normals
        light = self._ambient_light(points_m, normals)
        light *= _openness(origins, normals, [*blocks, *self.shell], self.reach_m)[:, None]
        for lamp in self.lamps:
            light += _lamp_light(lamp, origins, normals, blocks)
        if self.sun is not None:
            light += _sun_light(self.sun, origins, normals, blocks)
        return np.asarray(light ** np.float32(1 / 2.2), np.float32)

    def _ambient_light(self, points: Vectors, normals: Vectors) -> Vectors:
        lower, upper = _single(self.lower_m), _single(self.upper_m)
        # Light arrives from the side a surface faces, so it is looked up a metre in front of it.
        share = np.clip((points + normals - lower) / (upper - lower), 0, 1)
        value = self.ambient.astype(np.float32)[None]
        for axis in range(3):
            along = share[:, axis].reshape(-1, *[1] * (value.ndim - 2))
            value = value[:, 0] * (1 - along) + value[:, 1] * along
        return np.asarray(value, np.float32)


def _single(values: ArrayLike) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)


def first_hit(origins: Vectors, segments: Vectors, blocks: Sequence[Block]) -> NDArray[np.float32]:
    """Share (N,) of each segment (N, 3) before a block: 1 if all is free, 0 from inside one."""
    free = np.ones(len(origins), np.float32)
    for block in _within_reach(origins, segments, blocks):
        cos, sin = np.float32(np.cos(block.yaw_rad)), np.float32(np.sin(block.yaw_rad))
        start = origins - _single(block.centre_m)
        enter = np.zeros(len(origins), np.float32)
        leave = np.ones(len(origins), np.float32)
        local = (
            (cos * start[:, 0] + sin * start[:, 1], cos * segments[:, 0] + sin * segments[:, 1]),
            (cos * start[:, 1] - sin * start[:, 0], cos * segments[:, 1] - sin * segments[:, 0]),
            (start[:, 2], segments[:, 2]),
        )
        for (at, step), half in zip(local, _single(block.half_m), strict=True):
            inverse = 1 / np.where(np.abs(step) < 1e-9, np.float32(1e-9), step)
            middle, reach = -at * inverse, half * np.abs(inverse)
            np.maximum(enter, middle - reach, out=enter)
            np.minimum(leave, middle + reach, out=leave)
        np.minimum(free, np.where(enter <= leave, enter, np.float32(1)), out=free)
    return free


def _within_reach(origins: Vectors, segments: Vectors, blocks: Sequence[Block]) -> list[Block]:
    """The blocks whose bounding sphere touches the box around all segments; the others are free."""
    if not len(origins):
        return []
    ends = origins + segments
    lower = np.minimum(origins.min(axis=0), ends.min(axis=0))
    upper = np.maximum(origins.max(axis=0), ends.max(axis=0))
    near = []
    for block in blocks:
        nearest = np.clip(block.centre_m, lower, upper)
        if np.linalg.norm(nearest - block.centre_m) <= np.linalg.norm(block.half_m):
            near.append(block)
    return near


def _sky_directions(normals: Vectors) -> list[Vectors]:
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


def _openness(
    origins: Vectors, normals: Vectors, blocks: Sequence[Block], reach_m: float
) -> NDArray[np.float32]:
    """Ambient occlusion (N,): mean free length of cosine-distributed rays, floored at one fifth."""
    directions = _sky_directions(normals)
    total = np.zeros(len(origins), np.float32)
    for direction in directions:
        total += first_hit(origins, np.float32(reach_m) * direction, blocks)
    return np.asarray(0.2 + 0.8 * total / len(directions), np.float32)


def _lamp_light(lamp: Lamp, origins: Vectors, normals: Vectors, blocks: Sequence[Block]) -> Vectors:
    towards = _single(lamp.position_m) - origins
    distance = np.linalg.norm(towards, axis=1)
    facing = np.sum(towards * normals, axis=1) / distance
    leaving = -towards @ _single(lamp.axis) / distance
    strength = np.clip(facing, 0, 1) * np.clip(leaving, 0, 1) / (distance**2 + np.float32(0.15))
    reached = np.flatnonzero(strength > 1e-3)
    visible = first_hit(origins[reached], np.float32(0.97) * towards[reached], blocks) >= 1
    light = np.zeros((len(origins), 3), np.float32)
    light[reached] = (strength[reached] * visible)[:, None] * _single(lamp.colour)
    return light


def _sun_light(sun: Sun, origins: Vectors, normals: Vectors, blocks: Sequence[Block]) -> Vectors:
    towards = -_single(sun.direction) / np.float32(np.linalg.norm(sun.direction))
    strength = np.clip(normals @ towards, 0, 1)
    for_any = np.zeros(len(origins), bool)
    for lower, upper in sun.openings:
        low, high = np.minimum(lower, upper), np.maximum(lower, upper)
        axis = int(np.argmin(high - low))
        travel = (np.float32(low[axis]) - origins[:, axis]) / towards[axis]
        at = origins + travel[:, None] * towards
        others = [other for other in range(3) if other != axis]
        inside = np.all((at[:, others] > low[others]) & (at[:, others] < high[others]), axis=1)
        for_any |= inside & (travel > 0)
    lit = np.flatnonzero(for_any & (strength > 0))
    segments = np.broadcast_to(np.float32(8) * towards, (len(lit), 3))
    visible = first_hit(origins[lit], segments, blocks) >= 1
    light = np.zeros((len(origins), 3), np.float32)
    light[lit] = (strength[lit] * visible)[:, None] * _single(sun.colour)
    return light
