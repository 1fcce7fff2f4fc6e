"""A sampling box that works, and the command that collects in it: planned once, not rendered."""

from __future__ import annotations

import shlex
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import Box, CameraConfig, CollectionConfig, SceneConfig
from synfeal.errors import InputError
from synfeal.inspect.freespace import SLACK, FreeSpace, Survey, find_free_space, suggest_box
from synfeal.mesh.rays import RayCaster
from synfeal.planning.empty_pixels import EmptyPixels, empty_pixels
from synfeal.planning.plan import box_array, plan_split
from synfeal.seeds import generator_of
from synfeal.settings import SCENE

Array = NDArray[np.float64]

N_FRAMES = 300
SLACKS = (SLACK, 2 * SLACK, 1.0)  # the last leaves out only what is outside
NARROW_M = 0.6  # least path and view in a space too narrow for the defaults


@dataclass(frozen=True)
class Suggestion:
    """What was planned, and what came of it.

    Attributes:
        scene: with the suggested sampling box.
        collection: how the camera moves; the defaults unless the space is too narrow for them.
        empty: how much of the images would show nothing.
    """

    scene: SceneConfig
    collection: CollectionConfig
    empty: EmptyPixels

    @property
    def box_m(self) -> Array:
        """The box (2, 3)."""
        assert self.scene.sampling_box is not None
        return box_array(self.scene.sampling_box)

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

    Args:
        caster: rays against the mesh.
        found: what :func:`synfeal.inspect.freespace.survey` found.
        scene: path, axis, unit and angles.
    """
    spaces = [find_free_space(caster, found, slack) for slack in SLACKS]
    narrow = CollectionConfig(min_path_m=NARROW_M)
    near = scene.model_copy(update={"min_view_distance_m": NARROW_M})
    for each, collection in ((scene, CollectionConfig()), (near, narrow)):
        for space in spaces:
            box_m = suggest_box(space)
            if box_m is None:
                continue
            suggestion = _planned(caster, _with_box(each, box_m), collection)
            if suggestion is not None:
                return space, suggestion
    return spaces[0], None


def _with_box(scene: SceneConfig, box_m: Array) -> SceneConfig:
    x, y, z = ((low, high) for low, high in box_m.T.tolist())
    return scene.model_copy(update={"sampling_box": Box(x=x, y=y, z=z)})


def _planned(
    caster: RayCaster, scene: SceneConfig, collection: CollectionConfig
) -> Suggestion | None:
    """The suggestion, if paths can be planned as ``synfeal collect`` does with its defaults."""
    assert scene.sampling_box is not None
    box_m = box_array(scene.sampling_box)
    try:
        rng = generator_of(0, "plan", SCENE, "train")
        plan = plan_split(caster, box_m, scene, collection, N_FRAMES, rng)
    except InputError:
        return None
    return Suggestion(scene, collection, empty_pixels(caster, plan, CameraConfig()))
