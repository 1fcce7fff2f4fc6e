"""Materials, textures and colours reduced to what an unlit render shows.

That is a base colour, a texture of 8 bits, and an alpha cutoff. Metalness, roughness, normals and
light are dropped on purpose: the light of a reconstruction is in its texture. Blended materials
(glass, light shafts) become alpha-tested at one half, so that every pixel shows exactly one surface
and its depth is that surface's.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from trimesh.visual.color import linear_to_srgb, srgb_to_linear, to_float

from synfeal.errors import why
from synfeal.mesh.claims import check_textures
from synfeal.mesh.gltf import Json, base_color
from synfeal.mesh.model import WHITE, Findings

Pixels = NDArray[np.uint8]

BLEND_CUTOFF = 0.5
GLTF_DEFAULT_CUTOFF = 0.5
SRGB_ATTRIBUTE = "_SRGB"  # beside glTF's linear colours: the display colours, exact in 8 bits
MAX_SIDE_PX = 16_384  # GL_MAX_TEXTURE_SIZE of Mesa's software renderer and of most GPUs
MAX_PIXELS = 2**28  # a square of that side, 1 GB when decoded: what is larger is not decoded


@dataclass(frozen=True)
class BaseMaterial:
    """Texture (H, W, 3 | 4) or None, base colour (4,) uint8 sRGB, alpha cutoff or None.

    ``uv_transform`` (3, 3) applies to texture coordinates with the origin at the top left.
    """

    texture: Pixels | None
    base_color: Pixels
    alpha_cutoff: float | None = None
    uv_transform: NDArray[np.float64] | None = None

    def transformed(self, uv: NDArray[np.float64]) -> NDArray[np.float64]:
        """Apply the material's transform to texture coordinates (V, 2), origin bottom left."""
        if self.uv_transform is None:
            return uv
        top_left = np.column_stack([uv[:, 0], 1.0 - uv[:, 1], np.ones(len(uv))])
        u, v, _ = self.uv_transform @ top_left.T
        return np.column_stack([u, 1.0 - v])


class MaterialReader:
    """Reduces the materials of one file, each once, however many parts share it."""

    def __init__(self, header: Json | None, findings: Findings, path: Path) -> None:
        """Take the JSON of a glTF, whose colours and factors are linear, or None."""
        self._header = header
        self._findings = findings
        self._path = path
        self._n_pixels = 0
        self._known: dict[int, BaseMaterial] = {}

    def read(self, material: Any) -> BaseMaterial:
        """Reduce a trimesh material to its base colour, once per material."""
        if id(material) not in self._known:
            reduced = self._from_mtl if self._header is None else self._from_gltf
            self._known[id(material)] = reduced(material)
        return self._known[id(material)]

    def vertex_rgb(self, geometry: trimesh.Trimesh) -> Pixels | None:
        """Return the sRGB colours (V, 3) of a trimesh geometry's vertices; None if it has none."""
        exact = geometry.vertex_attributes.get(SRGB_ATTRIBUTE)
        if exact is not None:
            return np.asarray(exact, dtype=np.uint8)[:, :3]
        visual = geometry.visual
        extra = getattr(visual, "vertex_attributes", {})
        stored: Any = visual.vertex_colors if visual.kind == "vertex" else extra.get("color")
        if stored is None:
            return None
        colors = np.clip(np.nan_to_num(to_float(stored)), 0.0, 1.0)[:, :3]
        is_linear = self._header is not None
        return srgb_from_linear(colors) if is_linear else np.round(255 * colors).astype(np.uint8)

    def _from_gltf(self, material: Any) -> BaseMaterial:
        index = int(material.name)  # given by synfeal.mesh.gltf.simplified
        described = dict(enumerate((self._header or {}).get("materials", []))).get(index, {})
        owner = f"material '{described.get('name', 'unnamed')}'"
        color = base_color(described)
        texture = self._decoded(material.baseColorTexture, owner)
        base = srgb_from_linear(color.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0]))
        mode = described.get("alphaMode", "OPAQUE")
        cutoff = BLEND_CUTOFF if mode == "BLEND" else None
        if mode == "MASK":
            cutoff = float(described.get("alphaCutoff", GLTF_DEFAULT_CUTOFF))
        if cutoff is not None and texture is None and "baseColorTexture" in color:
            self._findings.warn(f"{owner}: its transparency was in its texture; drawn opaque")
        if is_opaque(texture, base):
            cutoff = None
        elif cutoff is not None:
            self._note_cutoff(owner, mode == "BLEND", cutoff)
        transform = uv_transform(color.get("baseColorTexture", {}))
        return BaseMaterial(texture, base, cutoff, transform)

    def _from_mtl(self, material: Any) -> BaseMaterial:
        """Convert an MTL or PLY material; alpha counts where ``map_d`` or ``d`` say so."""
        owner = f"material '{material.name or 'unnamed'}'"
        texture = self._decoded(material.image, owner)
        # MTL writes Kd next to map_Kd without meaning the product; many exporters leave Kd at 0.
        base = np.array(material.diffuse, np.uint8) if material.image is None else WHITE.copy()
        extra = {key.lower(): value for key, value in material.kwargs.items()}
        base[3] = round(255 * _mtl_opacity(extra))
        has_alpha = base[3] < 255 or "map_d" in extra
        if not has_alpha or is_opaque(texture, base):
            return BaseMaterial(None if texture is None else texture[..., :3], base)
        self._note_cutoff(owner, True, BLEND_CUTOFF)
        return BaseMaterial(texture, base, BLEND_CUTOFF)

    def _decoded(self, image: Image.Image | None, owner: str) -> Pixels | None:
        """Decode the texture, if it fits into memory beside those before it."""
        if image is not None and image.width * image.height <= MAX_PIXELS:
            self._n_pixels += image.width * image.height
            check_textures(self._path, self._n_pixels)
        return decode(image, owner, self._findings)

    def _note_cutoff(self, owner: str, is_blended: bool, cutoff: float) -> None:
        kind = "blended transparency becomes an alpha test" if is_blended else "alpha-tested"
        self._findings.note(f"{owner}: {kind} at {cutoff:.2g}")


def is_opaque(texture: Pixels | None, base: Pixels) -> bool:
    """Check whether texture and base colour are fully opaque."""
    texture_opaque = texture is None or texture.shape[2] == 3 or texture[..., 3].min() == 255
    return bool(texture_opaque and base[3] == 255)


def _mtl_opacity(extra: dict[str, Any]) -> float:
    """Return the opacity of an MTL: ``d``, or one minus ``Tr``; 1 where neither is a number."""
    for key, sign in (("d", 1.0), ("tr", -1.0)):
        try:
            value = float(extra[key][-1])
        except (KeyError, IndexError, ValueError):
            continue
        return float(np.clip(value if sign > 0 else 1.0 - value, 0.0, 1.0))
    return 1.0


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
