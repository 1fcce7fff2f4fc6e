"""What a file does not say of itself: the length of its unit, and which axis is up."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import SceneConfig
from synfeal.inspect.doubts import EXTENTS_M, FLOOR_RATIO, floor_areas_m2
from synfeal.inspect.surface import SurfacePoints, triangle_areas_m2
from synfeal.mesh.load import is_y_up, load_mesh
from synfeal.mesh.model import TexturedMesh

Array = NDArray[np.float64]

UNITS_M = {0.001: "millimetres", 0.01: "centimetres", 0.0254: "inches", 10.0: "", 100.0: ""}
UNITS_M |= {1000.0: "kilometres"}
STOREY_M = 3.0  # rooms are about that high, and longer along the other axes
N_POINTS = 20_000


def load_as_meant(
    scene: SceneConfig, unit_is_given: bool
) -> tuple[SceneConfig, TexturedMesh, list[str]]:
    """The mesh in the unit and with the axis up that make a room of it.

    What the person said is not changed, and nothing is while the mesh makes sense as it is.

    Args:
        scene: path, up axis and unit of the mesh.
        unit_is_given: whether ``scene.unit_m`` is what the person said.

    Returns:
        The scene as it was taken, the mesh, and a sentence for each thing that was assumed.
    """
    mesh, notes = _load(scene), []
    extents_m = mesh.bounds_m[1] - mesh.bounds_m[0]
    if not unit_is_given and not EXTENTS_M[0] <= extents_m.max() <= EXTENTS_M[1]:
        unit_m = likely_unit_m(extents_m)
        scene = scene.model_copy(update={"unit_m": unit_m})
        mesh = _load(scene)
        notes.append(_unit_note(extents_m, unit_m))
    if scene.up_axis == "auto":
        floors_m2 = _floors_m2(mesh)
        other = "z" if is_y_up(cast(Path, scene.path), "auto") else "y"
        turned = scene.model_copy(update={"up_axis": other})
        if floors_m2.argmax() == 1 and floors_m2[1] >= FLOOR_RATIO * floors_m2[2]:
            scene, mesh = turned, _load(turned)
            notes.append(
                f"taken with {other} up, where its largest floor is {floors_m2[1]:.3g} m^2 and not"
                f" {floors_m2[2]:.3g} m^2; if that is wrong, give --up-axis"
            )
    return scene, mesh, notes


def likely_unit_m(extents: Array) -> float:
    """The unit, metres, that makes the smallest extent (3,) most like the height of a room."""
    return min(UNITS_M, key=lambda unit: abs(np.log(unit * max(extents.min(), 1e-9) / STOREY_M)))


def _unit_note(extents: Array, unit_m: float) -> str:
    before = " x ".join(f"{extent:.3g}" for extent in extents)
    after = " x ".join(f"{extent:.3g}" for extent in unit_m * extents)
    name = UNITS_M[unit_m] or f"units of {unit_m:g} m"
    return (
        f"the mesh spans {before}, which no room does in metres; taken as {name} (--unit-m"
        f" {unit_m:g}), which makes it {after} m; if that is wrong, give --unit-m"
    )


def _load(scene: SceneConfig) -> TexturedMesh:
    assert scene.path is not None
    return load_mesh(scene.path, scene.up_axis, scene.unit_m)


def _floors_m2(mesh: TexturedMesh) -> Array:
    points = SurfacePoints.of(mesh, np.random.default_rng(0), N_POINTS)
    area_m2 = sum(float(triangle_areas_m2(part).sum()) for part in mesh.parts)
    return floor_areas_m2(points.normal, points.position_m, area_m2)
