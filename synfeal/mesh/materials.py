"""Materials and colours reduced to what an unlit render shows: base colour, texture, alpha cutoff.

Metalness, roughness, normals and light are dropped on purpose: the light of a reconstruction is in
its texture. Blended materials (glass, light shafts) become alpha-tested at one half, so that every
pixel shows exactly one surface and its depth is that surface's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from synfeal.mesh.gltf import Json, base_color
from synfeal.mesh.model import WHITE, Findings
from synfeal.mesh.textures import Pixels, decode

BLEND_CUTOFF = 0.5
GLTF_DEFAULT_CUTOFF = 0.5


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
        """Texture coordinates (V, 2), origin at the bottom left, after the material's transform."""
        if self.uv_transform is None:
            return uv
        top_left = np.column_stack([uv[:, 0], 1.0 - uv[:, 1], np.ones(len(uv))])
        u, v, _ = self.uv_transform @ top_left.T
        return np.column_stack([u, 1.0 - v])


class MaterialReader:
    """Reduces the materials of one file, each once, however many parts share it."""

    def __init__(self, header: Json | None, findings: Findings) -> None:
        """Take the JSON of a glTF, or None for other files."""
        self._header = header
        self._findings = findings
        self._known: dict[int, BaseMaterial] = {}

    @property
    def is_gltf(self) -> bool:
        """Whether colours and factors of the file are linear."""
        return self._header is not None

    def read(self, material: Any) -> BaseMaterial:
        """What a trimesh material amounts to."""
        if id(material) not in self._known:
            self._known[id(material)] = self._reduce(material)
        return self._known[id(material)]

    def _reduce(self, material: Any) -> BaseMaterial:
        if self._header is None:
            return self._from_mtl(material)
        described = self._header.get("materials", [])
        index = int(material.name)  # given by synfeal.mesh.gltf.simplified
        return self._from_gltf(material, described[index] if index < len(described) else {})

    def _from_gltf(self, material: Any, described: Json) -> BaseMaterial:
        owner = f"material '{described.get('name', 'unnamed')}'"
        colour = base_color(described)
        texture = self._texture(material.baseColorTexture, owner)
        base = srgb_from_linear(colour.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0]))
        mode = described.get("alphaMode", "OPAQUE")
        cutoff = BLEND_CUTOFF if mode == "BLEND" else None
        if mode == "MASK":
            cutoff = float(described.get("alphaCutoff", GLTF_DEFAULT_CUTOFF))
        if cutoff is not None and texture is None and "baseColorTexture" in colour:
            self._findings.warn(f"{owner}: its transparency was in its texture; drawn opaque")
        if is_opaque(texture, base):
            cutoff = None
        elif cutoff is not None:
            self._note_cutoff(owner, mode == "BLEND", cutoff)
        transform = uv_transform(colour.get("baseColorTexture", {}))
        return BaseMaterial(texture, base, cutoff, transform)

    def _from_mtl(self, material: Any) -> BaseMaterial:
        """An MTL or PLY material: alpha counts where ``map_d`` or ``d`` say so."""
        owner = f"material '{material.name or 'unnamed'}'"
        texture = self._texture(material.image, owner)
        # MTL writes Kd next to map_Kd without meaning the product; many exporters leave Kd at 0.
        base = np.array(material.diffuse, np.uint8) if material.image is None else WHITE.copy()
        extra = {key.lower(): value for key, value in material.kwargs.items()}
        base[3] = round(255 * _mtl_opacity(extra))
        has_alpha = base[3] < 255 or "map_d" in extra
        if not has_alpha or is_opaque(texture, base):
            return BaseMaterial(None if texture is None else texture[..., :3], base)
        self._note_cutoff(owner, True, BLEND_CUTOFF)
        return BaseMaterial(texture, base, BLEND_CUTOFF)

    def _texture(self, image: Any, owner: str) -> Pixels | None:
        return None if image is None else decode(image, owner, self._findings)

    def _note_cutoff(self, owner: str, is_blended: bool, cutoff: float) -> None:
        kind = "blended transparency becomes an alpha test" if is_blended else "alpha-tested"
        self._findings.note(f"{owner}: {kind} at {cutoff:.2g}")


def is_opaque(texture: Pixels | None, base: Pixels) -> bool:
    """Whether no texel lets anything through."""
    texture_opaque = texture is None or texture.shape[2] == 3 or texture[..., 3].min() == 255
    return bool(texture_opaque and base[3] == 255)


def _mtl_opacity(extra: dict[str, Any]) -> float:
    """Opacity of an MTL: ``d``, or one minus ``Tr``; 1 where neither is a number."""
    for key, sign in (("d", 1.0), ("tr", -1.0)):
        try:
            value = float(extra[key][-1])
        except (KeyError, IndexError, ValueError):
            continue
        return float(np.clip(value if sign > 0 else 1.0 - value, 0.0, 1.0))
    return 1.0


def uv_transform(slot: Json) -> NDArray[np.float64] | None:
    """Matrix (3, 3) of KHR_texture_transform: scale, then rotation, then offset."""
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
    """Display colours (..., 4) uint8 of linear ones in 0 to 1; alpha is linear in both."""
    value = np.clip(np.asarray(rgba, dtype=np.float64), 0.0, 1.0)
    curve = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    curve[..., 3:] = value[..., 3:]
    return np.round(255.0 * curve).astype(np.uint8)


def linear_from_srgb(rgba: ArrayLike) -> NDArray[np.float64]:
    """Linear colours (..., 4) in 0 to 1 of display colours uint8: what glTF stores."""
    value = np.asarray(rgba, dtype=np.float64) / 255.0
    curve = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    curve[..., 3:] = value[..., 3:]
    return curve


SRGB_ATTRIBUTE = "_SRGB"  # beside glTF's linear colours: the display colours, exact in 8 bits


def part_colours(geometry: trimesh.Trimesh, is_linear: bool) -> Pixels | None:
    """Display colours (V, 3) uint8 of the vertices of a trimesh geometry, if it has any.

    ``is_linear`` says whether the file stores linear colours, as glTF does.
    """
    exact = geometry.vertex_attributes.get(SRGB_ATTRIBUTE)
    if exact is not None:
        return np.asarray(exact, dtype=np.uint8)[:, :3]
    visual = geometry.visual
    is_plain = visual.kind == "vertex"
    extra = getattr(visual, "vertex_attributes", {})
    stored: Any = visual.vertex_colors if is_plain else extra.get("color")
    if stored is None:
        return None
    colours = as_fraction(stored)[:, :3]
    return srgb_from_linear(colours) if is_linear else np.round(255.0 * colours).astype(np.uint8)


def as_fraction(stored: Any) -> NDArray[np.float64]:
    """Values in 0 to 1 of integers, which span the range of their type, or of floats."""
    values = np.asarray(stored)
    largest = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1
    return np.asarray(np.clip(np.nan_to_num(values / largest), 0.0, 1.0), dtype=np.float64)
