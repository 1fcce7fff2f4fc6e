"""A sampling box that works, and the command that collects in it: planned once, not rendered."""

from __future__ import annotations

import shlex
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collection import Box, CollectionConfig, SceneConfig
from synfeal.config.dataset import CameraConfig
from synfeal.config.options import SCENE
from synfeal.errors import InputError
from synfeal.inspect.freespace import (
    CAMERA_HEIGHT_M,
    SLACK,
    FreeSpace,
    Survey,
    find_free_space,
    step_m_of,
)
from synfeal.mesh.rays import RayCaster
from synfeal.planning.coverage import EmptyPixels, empty_pixels
from synfeal.planning.plan import plan_split
from synfeal.records.provenance import generator_of

Array = NDArray[np.float64]

N_FRAMES = 300
SLACKS = (SLACK, 2 * SLACK, 1.0)  # the last leaves out only what is outside
NARROW_M = 0.6  # least path and view in a space too narrow for the defaults


@dataclass(frozen=True)
class Suggestion:
    """What was planned, and what came of it."""

    scene: SceneConfig  # with the sampling box
    # how the camera moves; the defaults unless the space is too narrow for them
    collection: CollectionConfig
    empty: EmptyPixels  # how much of the images would show nothing
    box_m: Array  # (2, 3) the sampling box

    @property
    def is_narrow(self) -> bool:
        """Whether no path of the default length was found."""
        return self.collection != CollectionConfig()

    def command(self, out: str) -> str:
        """The complete line that collects what was planned, ready for a shell."""
        scene, words = self.scene, ["synfeal", "collect", "--mesh", str(self.scene.path)]
        if scene.up_axis != "auto":
            words += ["--up-axis", scene.up_axis]
        if scene.unit_m != 1.0:
            words += ["--unit-m", f"{scene.unit_m:g}"]
        words += ["--box", *(f"{value:z.2f}" for value in self.box_m.T.ravel())]
        if self.is_narrow:
            words += ["--min-path", f"{self.collection.min_path_m:g}"]
            words += ["--min-view-distance", f"{scene.min_view_distance_m:g}"]
        return shlex.join([*words, "--frames", str(N_FRAMES), "--depth", "--out", out])


def suggest(
    caster: RayCaster, found: Survey, scene: SceneConfig
) -> tuple[FreeSpace, Suggestion | None]:
    """The free space of a mesh, and the first box in it that paths can be planned in.

    Boxes are tried in the most enclosed part of the space first, then in more of it, then with
    shorter paths. What is planned is what ``synfeal collect`` plans.
    """
    spaces = [find_free_space(caster, found, slack) for slack in SLACKS]
    narrow = CollectionConfig(min_path_m=NARROW_M)
    near = scene.model_copy(update={"min_view_distance_m": NARROW_M})
    for each, collection in ((scene, CollectionConfig()), (near, narrow)):
        for space in spaces:
            box_m = suggest_box(space)
            if box_m is None:
                continue
            x, y, z = ((low, high) for low, high in box_m.T.tolist())
            boxed = each.model_copy(update={"sampling_box": Box(x=x, y=y, z=z)})
            rng = generator_of(0, "plan", SCENE, "train")
            try:
                plan = plan_split(caster, box_m, boxed, collection, N_FRAMES, rng)
            except InputError:
                continue
            empty = empty_pixels(caster, plan, CameraConfig())
            return space, Suggestion(boxed, collection, empty, box_m)
    return spaces[0], None


Mask = NDArray[np.bool_]
Corner = tuple[int, int, int]

# A layer of points is worth adding to a box if more than 2/3 of it are wanted. A bound on the whole
# box instead would let it grow into the walls until the bound is used up.
UNWANTED_WEIGHT = 2.0


def largest_box(is_wanted: Mask) -> tuple[Corner, Corner]:
    """First and last indices, both included, of the box with the greatest worth.

    Worth is the number of wanted points less twice the number of others; at least one of (X, Y, Z)
    is wanted. Every pair of limits along x and z is tried; along y the best run of layers is found
    in one pass (Kadane).
    """
    worth = np.where(is_wanted, 1.0, -UNWANTED_WEIGHT)
    best: tuple[float, Corner, Corner] = (-np.inf, (0, 0, 0), (0, 0, 0))
    for z0, z1 in _pairs(worth.shape[2]):
        layer = worth[:, :, z0 : z1 + 1].sum(axis=2)
        value, (x0, y0), (x1, y1) = _best_rectangle(layer)
        if value > best[0]:
            best = (value, (x0, y0, z0), (x1, y1, z1))
    return best[1], best[2]


def _best_rectangle(worth: NDArray[np.float64]) -> tuple[float, tuple[int, int], tuple[int, int]]:
    """Greatest sum over a rectangle of (X, Y), with its first and last indices."""
    sums = np.vstack([np.zeros(worth.shape[1]), np.cumsum(worth, axis=0)])
    pairs = np.array(_pairs(worth.shape[0]))
    strips = sums[pairs[:, 1] + 1] - sums[pairs[:, 0]]
    until = np.cumsum(np.pad(strips, ((0, 0), (1, 0))), axis=1)
    gains = until[:, 1:] - np.minimum.accumulate(until[:, :-1], axis=1)
    y1, pair = (int(index) for index in np.unravel_index(gains.T.argmax(), gains.T.shape))
    (x0, x1), before = pairs[pair].tolist(), until[pair, : y1 + 1]
    y0 = int(np.flatnonzero(before == before.min())[-1])  # of several the shortest run
    return float(gains[pair, y1]), (x0, y0), (x1, y1)


def _pairs(count: int) -> list[tuple[int, int]]:
    """All (first, last) with first <= last < count."""
    return [(first, last) for first in range(count) for last in range(first, count)]


def suggest_box(space: FreeSpace) -> Array | None:
    """A box (2, 3) at camera heights to sample in: as large as can be while mostly clear.

    None if no clear point lies 0.8 to 2.0 m above the floor.
    """
    if space.floor_m is None:
        return None
    z_m = space.axes_m[2] - space.floor_m
    at_height = (z_m >= CAMERA_HEIGHT_M[0]) & (z_m <= CAMERA_HEIGHT_M[1])
    is_candidate = space.is_clear & at_height
    if not is_candidate.any():
        return None
    lower, upper = largest_box(is_candidate)
    limits = [
        (axis[first] - step_m_of(axis) / 4.0, axis[last] + step_m_of(axis) / 4.0)
        for axis, first, last in zip(space.axes_m, lower, upper, strict=True)
    ]
    return np.round(np.array(limits, np.float64).T, 2)
