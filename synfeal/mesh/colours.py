"""Colours of vertices and faces as 8-bit display colours, whatever a file stores them as."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.mesh.materials import srgb_from_linear
from synfeal.mesh.textures import Pixels

SRGB_ATTRIBUTE = "_SRGB"  # beside glTF's linear colours: the display colours, exact in 8 bits


def part_colours(geometry: trimesh.Trimesh, is_linear: bool) -> Pixels | None:
    """Display colours (V, 3) uint8 of the vertices of a trimesh geometry, if it has any.

    Args:
        geometry: as parsed.
        is_linear: whether the file stores linear colours, as glTF does.
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
