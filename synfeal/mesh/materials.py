"""Materials reduced to what an unlit render shows: a base colour, a texture, an alpha cutoff.

Metalness, roughness, normals and light are dropped on purpose: the light of a reconstruction is in
its texture. Blended materials (glass, light shafts) become alpha-tested at one half, so that every
pixel shows exactly one surface and its depth is that surface's.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from synfeal.mesh.model import WHITE

Pixels = NDArray[np.uint8]

BLEND_CUTOFF = 0.5
GLTF_DEFAULT_CUTOFF = 0.5

log = logging.getLogger("synfeal")


@dataclass(frozen=True)
class BaseMaterial:
    """Texture (H, W, 3 | 4) or None, base colour (4,) uint8 sRGB, alpha cutoff or None."""

    texture: Pixels | None
    base_color: Pixels
    alpha_cutoff: float | None


def reduce_material(material: Any, origin: str) -> BaseMaterial:
    """Base colour of a trimesh material; ``origin`` names file and part in warnings."""
    if hasattr(material, "baseColorFactor"):
        image = material.baseColorTexture
        factor = material.baseColorFactor
        base_color = WHITE if factor is None else srgb_from_linear(factor)
        cutoff = _alpha_cutoff(material.alphaMode, material.alphaCutoff)
    else:
        image, cutoff = material.image, None
        # MTL writes Kd next to map_Kd without meaning the product; many exporters leave Kd at 0.
        base_color = np.array(material.diffuse, np.uint8) if image is None else WHITE
    texture = None if image is None else decode(image, f"{origin}: material '{material.name}'")
    if texture is not None and texture.shape[2] == 3 and base_color[3] == 255:
        cutoff = None
    return BaseMaterial(texture, base_color, cutoff)


def _alpha_cutoff(mode: str | None, cutoff: float | None) -> float | None:
    """The cutoff a glTF alpha mode amounts to."""
    if mode == "MASK":
        return GLTF_DEFAULT_CUTOFF if cutoff is None else float(cutoff)
    return BLEND_CUTOFF if mode == "BLEND" else None


def decode(image: Image.Image, origin: str) -> Pixels | None:
    """Pixels (H, W, 3 | 4) uint8 of any image Pillow opens; None with a warning if it is broken."""
    try:
        return to_rgb(image)
    except (OSError, SyntaxError, ValueError) as error:  # Pillow raises all three on damaged files
        log.warning("%s: texture cannot be decoded (%s); its base colour is used", origin, error)
        return None


def to_rgb(image: Image.Image) -> Pixels:
    """Pixels (H, W, 3), or (H, W, 4) where the image carries transparency, as uint8.

    Palette, grey, grey with alpha, 16-bit, float, CMYK and YCbCr images are converted.
    """
    if image.mode.startswith("I") or image.mode == "F":
        return np.repeat(_grey_8bit(image)[..., None], 3, axis=2)
    has_alpha = image.mode in ("LA", "PA", "La", "RGBA", "RGBa") or "transparency" in image.info
    return np.asarray(image.convert("RGBA" if has_alpha else "RGB"))


def _grey_8bit(image: Image.Image) -> Pixels:
    """Grey (H, W) of an integer (16-bit range) or float (0 to 1) image."""
    values = np.asarray(image, dtype=np.float64)
    scale = 255.0 if image.mode == "F" else 255.0 / 65535.0
    return np.clip(np.round(values * scale), 0, 255).astype(np.uint8)


def srgb_from_linear(rgba: ArrayLike) -> Pixels:
    """Display colour (4,) of a linear uint8 factor (4,); alpha is linear in both."""
    value = np.asarray(rgba, dtype=np.float64) / 255.0
    curve = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.round(255.0 * np.append(curve[:3], value[3])).astype(np.uint8)


def linear_from_srgb(rgba: ArrayLike) -> list[float]:
    """Linear factor of a display colour (4,) uint8, each in 0 to 1: what glTF stores."""
    value = np.asarray(rgba, dtype=np.float64) / 255.0
    curve = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return [*map(float, curve[:3]), float(value[3])]
