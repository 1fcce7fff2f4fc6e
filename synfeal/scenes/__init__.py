"""Procedural stand-ins for meshes that cannot be downloaded freely."""

from __future__ import annotations

from collections.abc import Callable

from synfeal.errors import InputError
from synfeal.mesh.model import TexturedMesh
from synfeal.scenes import large_room, random_room, sanctuary

BUILDERS: dict[str, Callable[[int], TexturedMesh]] = {
    "large_room": large_room.build,
    "sanctuary": sanctuary.build,
    "random_room": random_room.build,
}


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
