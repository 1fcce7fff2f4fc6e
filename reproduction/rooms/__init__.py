"""Procedural stand-ins for meshes that cannot be downloaded freely."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from reproduction.rooms import large_room, random_room, sanctuary
from reproduction.rooms.bake import light_shares, scanned_mesh
from synfeal.errors import InputError
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.save import save_glb

# What each is scanned from, by seed.
BUILDERS = {
    "large_room": large_room.ingredients,
    "sanctuary": sanctuary.ingredients,
    "random_room": random_room.ingredients,
}
# Scenes whose lights can be switched.
SWITCHED = ("large_room", "sanctuary")


def save_light_shares(builder: str, seed: int, out_shares: Sequence[Path]) -> None:
    """Write what share of a stand-in's light comes from each group of sources.

    The meshes are for :func:`synfeal.effects.scene.open_scene`, which switches the groups.

    Args:
        builder: Key of ``BUILDERS``.
        seed: Seed of the room.
        out_shares: Files ``light_<group>.glb`` to write, one per group, all in one folder.

    Raises:
        InputError: the lights of this room cannot be switched.
    """
    if builder not in SWITCHED:
        raise InputError(
            "builder", f"the lights of {builder} cannot be switched", "leave states out"
        )
    for group, mesh in light_shares(*BUILDERS[builder](seed)).items():
        save_glb(out_shares[0].with_name(f"light_{group}.glb"), mesh)


def build_scene(builder: str, seed: int) -> TexturedMesh:
    """Build the procedural scene ``builder``: textured, lit, z up, metres; one seed, same bytes.

    Raises:
        InputError: if there is no such builder.
    """
    if builder not in BUILDERS:
        raise InputError(
            "builder", f"no procedural scene '{builder}'", f"choose one of {sorted(BUILDERS)}"
        )
    return scanned_mesh(*BUILDERS[builder](seed))
