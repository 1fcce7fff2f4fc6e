"""The files a mesh refers to: found where people really put them, and remembered when missing."""

from __future__ import annotations

import io
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from PIL import Image
from trimesh.resolvers import FilePathResolver

from synfeal.mesh.gltf import BIN_URI, DECODED_URI, Gltf, Json, base_color, image_uri
from synfeal.mesh.model import Findings

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".tif", ".tiff")


class RecordingResolver(FilePathResolver):  # type: ignore[misc]  # trimesh is untyped
    """Reads the files a mesh refers to and remembers those that cannot be read.

    trimesh passes over missing textures silently; a grey scene should not surprise its user.
    """

    def __init__(self, source: Path, gltf: Gltf | None = None) -> None:
        super().__init__(str(source), allow_anywhere=True)  # a user's own file, often ../textures
        self.missing: list[str] = []
        self.unreadable: list[str] = []
        self._held = {} if gltf is None else {BIN_URI: gltf.binary, DECODED_URI: gltf.decoded}

    def get(self, name: str) -> bytes:
        """Bytes of a file the mesh refers to.

        Raises:
            FileNotFoundError: it is nowhere it could be meant to be.
        """
        if name in self._held:
            return self._held[name]
        for candidate in _spellings(str(name)):
            path = Path(self.parent) / candidate
            if path.is_file():
                return self._checked(str(name), path.read_bytes())
        self.missing.append(str(name))
        raise FileNotFoundError(f"'{name}' is missing")

    def _checked(self, name: str, content: bytes) -> bytes:
        """The content, its name remembered if it should be an image and is none."""
        if PurePosixPath(name).suffix.lower() in IMAGE_SUFFIXES:
            try:
                Image.open(io.BytesIO(content)).close()
            except (OSError, SyntaxError, ValueError):
                self.unreadable.append(name)
        return content


def _spellings(name: str) -> dict[str, None]:
    """Paths a reference can mean: as written, percent-encoded, from Windows, without its folder.

    Exporters write the absolute path of the artist's disk; the file then lies beside the mesh. An
    MTL may put options before the name.
    """
    plain = name.split()[-1] if name.lstrip().startswith("-") else name.strip().strip('"')
    slashes = unquote(plain).replace("\\", "/")
    return dict.fromkeys([name, plain, unquote(plain), slashes, PurePosixPath(slashes).name])


def report_missing(missing: list[str], findings: Findings, gltf: Gltf | None) -> None:
    """A warning per missing file, and one finding for those that no unlit render needs."""
    users = {} if gltf is None else base_color_files(gltf.header)
    unused = []
    for name in dict.fromkeys(missing):
        if gltf is None:
            findings.warn(f"'{name}' is missing; base colours are used instead")
        elif name in users:
            materials = ", ".join(f"'{material}'" for material in users[name])
            findings.warn(
                f"texture '{name}' of material {materials} is missing; its base colour is used"
            )
        else:
            unused.append(f"'{name}'")
    if unused:
        findings.note(
            f"{len(unused)} missing textures hold no colour and are not needed: {', '.join(unused)}"
        )


def base_color_files(header: Json) -> dict[str, list[str]]:
    """Names of the materials by the base-colour file they use."""
    users: dict[str, list[str]] = {}
    for material in header.get("materials", []):
        slot = base_color(material).get("baseColorTexture")
        uri = None if slot is None else image_uri(header, slot["index"])
        if uri is not None:
            users.setdefault(uri, []).append(material.get("name", "unnamed"))
    return users
