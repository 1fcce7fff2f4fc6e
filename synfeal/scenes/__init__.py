"""Procedural stand-ins for meshes that cannot be downloaded freely."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from synfeal.errors import InputError
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.scenes import large_room, random_room, sanctuary
from synfeal.scenes.bake import light_shares

BUILDERS: dict[str, Callable[[int], TexturedMesh]] = {
    "large_room": large_room.build,
    "sanctuary": sanctuary.build,
    "random_room": random_room.build,
}


# Scenes whose lights can be switched.
INGREDIENTS = {"large_room": large_room.ingredients, "sanctuary": sanctuary.ingredients}


def save_light_shares(builder: str, seed: int, directory: Path) -> None:
    """Write ``light_<group>.glb`` of a stand-in for :func:`synfeal.effects.relight.open_scene`.

    Raises:
        InputError: its lights cannot be switched.
    """
    if builder not in INGREDIENTS:
        raise InputError(f"builder: the lights of {builder} cannot be switched; leave states out")
    for group, mesh in light_shares(*INGREDIENTS[builder](seed)).items():
        save_glb(directory / f"light_{group}.glb", mesh)


def build_scene(builder: str, seed: int) -> TexturedMesh:
    """The procedural scene ``builder``: textured, lit, z up, metres; the same bytes for one seed.

    Raises:
        InputError: if there is no such builder.
    """
    if builder not in BUILDERS:
        raise InputError(
            f"builder: no procedural scene '{builder}'; choose one of {sorted(BUILDERS)}"
        )
    return BUILDERS[builder](seed)
