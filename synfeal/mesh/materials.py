"""Materials, textures and colours reduced to what an unlit render shows.

That is a base colour, a texture of 8 bits, and an alpha cutoff. Metalness, roughness, normals and
light are dropped on purpose: the light of a reconstruction is in its texture. Blended materials
(glass, light shafts) become alpha-tested at one half, so that every pixel shows exactly one surface
and its depth is that surface's.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from trimesh.visual.color import linear_to_srgb, srgb_to_linear, to_float

from synfeal.errors import why
from synfeal.mesh.claims import check_textures
from synfeal.mesh.gltf import REPEAT, Json, base_color, sampler_of
from synfeal.mesh.model import Findings
from synfeal.mesh.references import ReferenceResolver

Pixels = NDArray[np.uint8]

BLEND_CUTOFF = 0.5
GLTF_DEFAULT_CUTOFF = 0.5
SRGB_ATTRIBUTE = "_SRGB"  # beside glTF's linear colours: the display colours, exact in 8 bits
MAX_SIDE_PX = 16_384  # GL_MAX_TEXTURE_SIZE of Mesa's software renderer and of most GPUs
MAX_PIXELS = 2**28  # a square of that side, 1 GB when decoded: what is larger is not decoded


@dataclass(frozen=True)
class BaseMaterial:
    """Properties of a glTF material that an unlit image shows.

    Attributes:
        texture: Pixels (H, W, 3 | 4), or None.
        base_color: Colour (4,) uint8, sRGB.
        alpha_cutoff: Least opacity shown, of texture and base colour; None where they are opaque.
        uv_transform: Matrix (3, 3) for texture coordinates with the origin at the top left.
        vertex_cutoff: Opacity below which vertices are not seen; None where theirs does not count.
        wrap: How the texture goes on beyond 0 and 1, along u and v, by glTF's numbers.
        owner: What findings call it.
    """

    texture: Pixels | None
    base_color: Pixels
    alpha_cutoff: float | None = None
    uv_transform: NDArray[np.float64] | None = None
    vertex_cutoff: float | None = None
    wrap: tuple[int, int] = (REPEAT, REPEAT)
    owner: str = "material"
    _doubled: dict[tuple[bool, bool], Pixels] = field(default_factory=dict, repr=False)

    def doubled(self, along_u: bool, along_v: bool, findings: Findings) -> Pixels:
        """Return the texture with its mirror image beside or above it, or both; once for all."""
        key = (along_u, along_v)
        if key not in self._doubled:
            assert self.texture is not None
            texture = mirrored(self.texture, along_u, along_v)
            self._doubled[key] = within_limit(texture, self.owner, findings)
        return self._doubled[key]

    def transformed(self, uv: NDArray[np.float64]) -> NDArray[np.float64]:
        """Apply the material's transform to texture coordinates (V, 2), origin bottom left."""
        if self.uv_transform is None:
            return uv
        top_left = np.column_stack([uv[:, 0], 1.0 - uv[:, 1], np.ones(len(uv))])
        u, v, _ = self.uv_transform @ top_left.T
        return np.column_stack([u, 1.0 - v])


class _Decoder:
    """Decodes the textures of one file, if they fit into memory together."""

    def __init__(self, path: Path, findings: Findings) -> None:
        self._path = path
        self._findings = findings
        self._n_pixels = 0

    def _decoded(self, image: Image.Image | None, owner: str) -> Pixels | None:
        if image is not None and image.width * image.height <= MAX_PIXELS:
            self._n_pixels += image.width * image.height
            check_textures(self._path, self._n_pixels)
        return decode(image, owner, self._findings)


class TextureReader(_Decoder):
    """Reads the texture files that an OBJ or PLY names, each once."""

    def __init__(self, path: Path, resolver: ReferenceResolver, findings: Findings) -> None:
        """Take the mesh's file, and what finds the files it names."""
        super().__init__(path, findings)
        self._resolver = resolver
        self._known: dict[str, Pixels | None] = {}

    def read(self, name: str, owner: str) -> Pixels | None:
        """Return pixels (H, W, 3 | 4); None if the file is missing or no image, which is told.

        Args:
            name: File, as the mesh has it.
            owner: What findings call its owner, such as ``material 'Wall'``.
        """
        if name not in self._known:
            self._known[name] = self._read(name, owner)
        return self._known[name]

    def _read(self, name: str, owner: str) -> Pixels | None:
        try:
            content = self._resolver.get(name)
        except FileNotFoundError:  # remembered by the resolver
            return None
        try:
            image = Image.open(io.BytesIO(content))
        except (OSError, SyntaxError, ValueError):
            self._resolver.unreadable.append(name)
            return None
        return self._decoded(image, owner)


class MaterialReader(_Decoder):
    """Reduces the materials of one glTF, each once, however many parts share it."""

    def __init__(self, header: Json, findings: Findings, path: Path) -> None:
        """Take the JSON of the glTF, whose colours and factors are linear."""
        super().__init__(path, findings)
        self._header = header
        self._known: dict[int, BaseMaterial] = {}
        self._textureless: set[str] = set()

    def read(self, material: Any) -> BaseMaterial:
        """Reduce a trimesh material to its base colour, once per material."""
        if id(material) not in self._known:
            self._known[id(material)] = self._from_gltf(material)
        return self._known[id(material)]

    def report_lost_textures(self) -> None:
        """Name materials whose texture did not arrive and is named nowhere else."""
        said = " ".join(self._findings.sentences)
        for owner in sorted(self._textureless):
            if owner.removeprefix("material ") not in said:
                self._findings.warn(f"{owner}: its texture cannot be read; its base colour is used")

    def vertex_opacity(self, geometry: trimesh.Trimesh) -> NDArray[np.float64] | None:
        """Return the opacity (V,) of a trimesh geometry's vertices; None if all are opaque."""
        if SRGB_ATTRIBUTE in geometry.vertex_attributes:  # our own files, always opaque
            return None
        stored = _stored_colors(geometry)
        if stored is None or np.shape(stored)[1] < 4:
            return None
        opacity = np.clip(np.nan_to_num(to_float(stored)[:, 3], nan=1.0), 0.0, 1.0)
        return None if (opacity == 1.0).all() else np.asarray(opacity, np.float64)

    def vertex_rgb(self, geometry: trimesh.Trimesh) -> Pixels | None:
        """Return the sRGB colours (V, 3) of a trimesh geometry's vertices; None if it has none."""
        exact = geometry.vertex_attributes.get(SRGB_ATTRIBUTE)
        if exact is not None:
            return np.asarray(exact, dtype=np.uint8)[:, :3]
        stored = _stored_colors(geometry)
        if stored is None:
            return None
        return srgb_from_linear(np.clip(np.nan_to_num(to_float(stored)), 0.0, 1.0)[:, :3])

    def _from_gltf(self, material: Any) -> BaseMaterial:
        index = int(material.name)  # given by synfeal.mesh.gltf.simplified
        described = dict(enumerate(self._header.get("materials", []))).get(index, {})
        owner = f"material '{described.get('name', 'unnamed')}'"
        color = base_color(described)
        texture = self._decoded(material.baseColorTexture, owner)
        base = srgb_from_linear(color.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0]))
        mode = described.get("alphaMode", "OPAQUE")
        cutoff = BLEND_CUTOFF if mode == "BLEND" else None
        if mode == "MASK":
            cutoff = float(described.get("alphaCutoff", GLTF_DEFAULT_CUTOFF))
        if texture is None and "baseColorTexture" in color:
            self._textureless.add(owner)
            if cutoff is not None:
                self._findings.warn(f"{owner}: its transparency was in its texture; drawn opaque")
        vertex_cutoff = cutoff
        if is_opaque(texture, base):
            cutoff = None
        elif cutoff is not None:
            self._note_cutoff(owner, mode == "BLEND", cutoff)
        transform = uv_transform(color.get("baseColorTexture", {}))
        sampler = sampler_of(self._header, described)
        wrap = (int(sampler.get("wrapS", REPEAT)), int(sampler.get("wrapT", REPEAT)))
        return BaseMaterial(texture, base, cutoff, transform, vertex_cutoff, wrap, owner)

    def _note_cutoff(self, owner: str, is_blended: bool, cutoff: float) -> None:
        kind = "blended transparency becomes an alpha test" if is_blended else "alpha-tested"
        self._findings.note(f"{owner}: {kind} at {cutoff:.2g}")


def _stored_colors(geometry: trimesh.Trimesh) -> Any:
    """Return the colours (V, 3 | 4) of a geometry as the file has them, None if it has none."""
    visual = geometry.visual
    extra = getattr(visual, "vertex_attributes", {})
    return visual.vertex_colors if visual.kind == "vertex" else extra.get("color")


def mirrored(texture: Pixels, along_u: bool, along_v: bool) -> Pixels:
    """Return a texture (H, W, C) with its mirror image beside or above it, or both."""
    if along_u:
        texture = np.concatenate([texture, texture[:, ::-1]], axis=1)
    if along_v:  # v goes up, rows go down
        texture = np.concatenate([texture[::-1], texture], axis=0)
    return texture


def is_opaque(texture: Pixels | None, base: Pixels) -> bool:
    """Check whether texture and base colour are fully opaque."""
    texture_opaque = texture is None or texture.shape[2] == 3 or texture[..., 3].min() == 255
    return bool(texture_opaque and base[3] == 255)


def uv_transform(slot: Json) -> NDArray[np.float64] | None:
    """Return the matrix (3, 3) of KHR_texture_transform: scale, then rotation, then offset."""
    found = slot.get("extensions", {}).get("KHR_texture_transform")
    if found is None:
        return None
    (u, v), (scale_u, scale_v) = found.get("offset", (0, 0)), found.get("scale", (1, 1))
    cos, sin = np.cos(found.get("rotation", 0.0)), np.sin(found.get("rotation", 0.0))
    rotation = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    translation = np.array([[1.0, 0.0, u], [0.0, 1.0, v], [0.0, 0.0, 1.0]])
    matrix: NDArray[np.float64] = translation @ rotation @ np.diag([scale_u, scale_v, 1.0])
    return matrix


def srgb_from_linear(rgba: ArrayLike) -> Pixels:
    """Convert linear colours (..., 4), 0 to 1, to sRGB uint8; alpha is linear in both."""
    value = np.clip(np.asarray(rgba, dtype=np.float64), 0.0, 1.0)
    value[..., :3] = linear_to_srgb(value[..., :3])
    return np.round(255.0 * value).astype(np.uint8)


def linear_from_srgb(rgba: ArrayLike) -> NDArray[np.float64]:
    """Convert sRGB colours (..., 4) uint8 to the linear ones, 0 to 1, that glTF stores."""
    value = np.asarray(rgba, dtype=np.float64) / 255.0
    value[..., :3] = srgb_to_linear(value[..., :3])
    return value


@contextmanager
def large_images_allowed() -> Iterator[None]:
    """Lift Pillow's limit on image size, which guards against hostile files from the web.

    Textures of scans exceed it regularly; :func:`decode` has a limit of its own.
    """
    limit = Image.MAX_IMAGE_PIXELS
    Image.MAX_IMAGE_PIXELS = None
    try:
        yield
    finally:
        Image.MAX_IMAGE_PIXELS = limit


def decode(image: Image.Image | None, owner: str, findings: Findings) -> Pixels | None:
    """Decode an image to 8-bit pixels.

    Args:
        image: The opened image, or None where it is missing.
        owner: What findings call the image's owner, such as ``material 'Wall'``.
        findings: Collects what was converted, made smaller or given up.

    Returns:
        Pixels (H, W, 3), or (H, W, 4) with transparency, uint8; None if the image is missing,
        damaged or too large.
    """
    if image is None:
        return None
    width, height = image.size
    if width * height > MAX_PIXELS:
        findings.warn(
            f"{owner}: texture of {width} x {height} pixels is too large to be read; its base"
            f" colour is used. Make it at most {MAX_SIDE_PX} pixels wide and high"
        )
        return None
    try:
        pixels = to_rgb(image)
    except (OSError, SyntaxError, ValueError) as error:  # Pillow raises all three on damaged files
        findings.warn(f"{owner}: texture cannot be decoded ({why(error)}); its base colour is used")
        return None
    if image.mode not in ("RGB", "RGBA") or pixels.shape[2] != len(image.getbands()):
        kind = "RGBA" if pixels.shape[2] == 4 else "RGB"
        findings.note(f"{owner}: texture converted from {image.mode} to 8-bit {kind}")
    return within_limit(pixels, owner, findings)


def within_limit(pixels: Pixels, owner: str, findings: Findings) -> Pixels:
    """Shrink pixels (H, W, C) if a side exceeds what renderers take; see :func:`decode`."""
    height, width = pixels.shape[:2]
    if max(height, width) <= MAX_SIDE_PX:
        return pixels
    factor = MAX_SIDE_PX / max(height, width)
    size = (max(1, round(width * factor)), max(1, round(height * factor)))
    findings.warn(
        f"{owner}: texture made smaller from {width} x {height} to {size[0]} x {size[1]} pixels,"
        " which is what renderers take"
    )
    return np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BOX))


def to_rgb(image: Image.Image) -> Pixels:
    """Convert an image to pixels (H, W, 3), or (H, W, 4) where it carries transparency, as uint8.

    Palette, grey, grey with alpha, 16-bit, float, CMYK and YCbCr images are converted.
    """
    if image.mode.startswith("I") or image.mode == "F":  # of 16 bits, or 0 to 1
        scale = 255.0 if image.mode == "F" else 255.0 / 65535.0
        grey = np.clip(np.round(np.asarray(image, dtype=np.float64) * scale), 0, 255)
        return np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2)
    has_alpha = image.mode in ("LA", "PA", "La", "RGBA", "RGBa") or "transparency" in image.info
    mode = "RGBA" if has_alpha else "RGB"
    return np.asarray(image if image.mode == mode else image.convert(mode))
