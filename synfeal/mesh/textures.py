"""Telling the user which texture files a mesh refers to that are not there."""

from __future__ import annotations

import json
import logging
import struct
from pathlib import Path
from typing import Any

from trimesh.resolvers import FilePathResolver

log = logging.getLogger("synfeal")


class RecordingResolver(FilePathResolver):  # type: ignore[misc]  # trimesh is untyped
    """Reads the files a mesh refers to and remembers those that cannot be read.

    trimesh passes over missing textures silently; a grey scene should not surprise its user.
    """

    def __init__(self, source: str) -> None:
        super().__init__(source)
        self.missing: list[str] = []

    def get(self, name: str) -> bytes:
        """Bytes of a file beside the mesh."""
        try:
            return bytes(super().get(name))
        except Exception:
            self.missing.append(str(name))
            raise


def warn_missing_textures(path: Path, missing: list[str]) -> None:
    """One warning per missing file that carries colour, naming the material where it is known."""
    users = gltf_base_color_files(path)
    for name in dict.fromkeys(missing):
        if users is None:
            log.warning("%s: '%s' is missing; base colours are used instead", path, name)
        elif name in users:
            materials = ", ".join(users[name])
            log.warning(
                "%s: texture '%s' of material %s is missing; its base colour is used",
                path,
                name,
                materials,
            )


def gltf_base_color_files(path: Path) -> dict[str, list[str]] | None:
    """Names of the materials by the base-colour file they use; None if the file is not glTF."""
    header = _gltf_header(path)
    if header is None:
        return None
    users: dict[str, list[str]] = {}
    for material in header.get("materials", []):
        file = _base_color_file(header, material)
        if file is not None:
            users.setdefault(file, []).append(f"'{material.get('name', 'unnamed')}'")
    return users


def _base_color_file(header: dict[str, Any], material: dict[str, Any]) -> str | None:
    """URI of the base-colour (or specular-glossiness diffuse) texture of a glTF material."""
    glossy = material.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness", {})
    slot = material.get("pbrMetallicRoughness", {}).get("baseColorTexture")
    slot = slot or glossy.get("diffuseTexture")
    if slot is None:
        return None
    source = header["textures"][slot["index"]].get("source")
    uri = None if source is None else header["images"][source].get("uri")
    return None if uri is None else str(uri)


def _gltf_header(path: Path) -> dict[str, Any] | None:
    """The JSON of a glTF or GLB file."""
    suffix = path.suffix.lower()
    if suffix == ".gltf":
        text = path.read_bytes()
    elif suffix == ".glb":
        with path.open("rb") as file:
            (length,) = struct.unpack("<12xI4x", file.read(20))
            text = file.read(length)
    else:
        return None
    header: dict[str, Any] = json.loads(text)
    return header
