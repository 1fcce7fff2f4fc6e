"""What a mesh is called: by its author, or by its file."""

from __future__ import annotations

import re
from pathlib import Path

from synfeal.mesh.gltf import read_gltf

# Names that exporters and download sites give to every file.
EVERYBODYS = ("scene", "model", "mesh", "index", "untitled", "textured", "object", "output")


def title_of(path: Path) -> str:
    """The title in a glTF, else the name of the file, else, if that says nothing, its folder's."""
    if path.suffix.lower() in (".gltf", ".glb"):
        extras = read_gltf(path).header["asset"].get("extras")
        title = extras.get("title") if isinstance(extras, dict) else None
        if isinstance(title, str) and title.strip():
            return " ".join(title.split())
    folder = path.resolve().parent.name
    return folder if path.stem.lower() in EVERYBODYS and folder else path.stem


def slug_of(title: str) -> str:
    """A title as a name that configurations and shells take without quotes."""
    return re.sub(r"[^a-z0-9]+", "_", title.lower().replace("'", "")).strip("_")[:64] or "scene"
