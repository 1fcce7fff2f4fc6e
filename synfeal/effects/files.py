"""Files beside the mesh of a scene that effects need, by name.

The workflow names them too, so this module loads nothing but the standard library.
"""

from __future__ import annotations

from pathlib import Path

# Groups of light sources: how much of a scene's light comes from each is a mesh of its own.
LIGHT_GROUPS = ("ambient", "lamps", "daylight")
CARTONS = 8  # built-in objects


def light_share_files(mesh: Path) -> dict[str, Path]:
    """Return the meshes with the shares of a scene's light, by group of sources.

    Args:
        mesh: Mesh of the scene.
    """
    return {group: mesh.with_name(f"light_{group}.glb") for group in LIGHT_GROUPS}


def carton_files(mesh: Path) -> tuple[Path, ...]:
    """Return the files of the built-in objects of a scene.

    Args:
        mesh: Mesh of the scene.
    """
    return tuple(mesh.with_name(f"carton_{number}.glb") for number in range(CARTONS))
