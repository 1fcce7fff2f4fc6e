"""Files that a mesh refers to: buffers, materials and textures, read from its own folder only.

A mesh from the web may name any file of the machine that reads it. What a name, an absolute path or
a link leads to outside of the mesh's folder is refused, not read.
"""

from __future__ import annotations

import io
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from PIL import Image
from trimesh.resolvers import FilePathResolver

from synfeal.errors import InputError
from synfeal.mesh.gltf import BIN_URI, DECODED_URI, Gltf, base_color_file
from synfeal.mesh.model import Findings
from synfeal.records.files import lies_in

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".tif", ".tiff")


class ReferenceResolver(FilePathResolver):  # type: ignore[misc]  # trimesh is untyped
    """Reads the files a mesh refers to and remembers those that cannot be read.

    trimesh passes over missing textures silently; a grey scene should not surprise its user. It
    passes over refusals, too: :meth:`raise_refusal` after it is done.
    """

    def __init__(self, source: Path, gltf: Gltf | None = None) -> None:
        super().__init__(str(source))
        self.missing: list[str] = []
        self.unreadable: list[str] = []
        self._refusal: InputError | None = None
        self._source = source
        # Where the mesh is a link, as in a download cache, its companions lie beside either end.
        self._folders = (Path(self.parent), source.resolve().parent)
        self._held = {} if gltf is None else {BIN_URI: gltf.binary, DECODED_URI: gltf.decoded}

    def get(self, name: str) -> bytes:
        """Read a file the mesh refers to.

        Raises:
            FileNotFoundError: It is nowhere it could be meant to be.
            InputError: It is there, outside of the mesh's folder.
        """
        content = self.find(name)
        if content is None:
            self.missing.append(name)
            raise FileNotFoundError(f"'{name}' is missing")
        return content

    def find(self, name: str) -> bytes | None:
        """Read a file the mesh refers to; None if it is nowhere it could be meant to be.

        Raises:
            InputError: It is there, outside of the mesh's folder.
        """
        if name in self._held:
            return self._held[name]
        found = [p for p in (Path(self.parent) / s for s in _spellings(name)) if p.is_file()]
        for path in found:
            if any(lies_in(path, folder) for folder in self._folders):
                return self._checked(name, path.read_bytes())
        if found:
            self._refusal = self._refusal or InputError(
                self._source,
                f"refers to '{name}', which leads out of its folder and is not read",
                "put a copy beside the mesh and name that",
            )
            raise self._refusal
        other = self._in_other_case(name)
        return None if other is None else self._checked(name, other.read_bytes())

    def _in_other_case(self, name: str) -> Path | None:
        """Find a file whose name differs in upper and lower case, as Windows does not mind."""
        for spelling in _spellings(name):
            path = Path(self.parent) / spelling
            wanted = path.name.lower()
            try:
                beside = sorted(path.parent.iterdir())
            except OSError:
                continue
            for other in beside:
                is_meant = other.name.lower() == wanted and other.is_file()
                if is_meant and any(lies_in(other, folder) for folder in self._folders):
                    return other
        return None

    def raise_refusal(self) -> None:
        """Raise the first refusal, if there was one."""
        if self._refusal is not None:
            raise self._refusal

    def _checked(self, name: str, content: bytes) -> bytes:
        """Return the content, and remember its name if it should be an image and is none."""
        if PurePosixPath(name).suffix.lower() in IMAGE_SUFFIXES:
            try:
                Image.open(io.BytesIO(content)).close()
            except (OSError, SyntaxError, ValueError):
                self.unreadable.append(name)
        return content


def _spellings(name: str) -> dict[str, None]:
    """List paths a reference can mean: as written, percent-encoded, from Windows, without folder.

    Exporters write the absolute path of the artist's disk; the file then lies beside the mesh.
    """
    plain = name.strip().strip('"')
    slashes = unquote(plain).replace("\\", "/")
    return dict.fromkeys([name, plain, unquote(plain), slashes, PurePosixPath(slashes).name])


def report_missing(missing: list[str], findings: Findings, gltf: Gltf | None) -> None:
    """Report missing files: a warning for each, and one note for those that no unlit render needs.

    Args:
        missing: Names of the files as the mesh has them; repeated ones are reported once.
        findings: Collects the reports.
        gltf: The glTF file, which tells what a texture is used for; None for other formats, where
            every file counts as needed.
    """
    users: dict[str | None, list[str]] = {}
    header = {} if gltf is None else gltf.header
    for material in header.get("materials", []):
        file = base_color_file(header, material)
        users.setdefault(file, []).append(f"'{material.get('name', 'unnamed')}'")
    unused = []
    for name in dict.fromkeys(missing):
        if gltf is None:
            findings.warn(f"'{name}' is missing; base colours are used instead")
        elif name in users:
            findings.warn(
                f"texture '{name}' of material {', '.join(users[name])} is missing; its base colour"
                " is used"
            )
        else:
            unused.append(f"'{name}'")
    if unused:
        findings.note(
            f"{len(unused)} missing textures hold no colour and are not needed: {', '.join(unused)}"
        )
