"""Parts as backends take them: not too large for a driver, alpha tests decided in the texture."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.model import MeshPart

# Mesa's software renderer silently draws nonsense from a buffer of 2^24 vertices on.
MOST_VERTICES = 1 << 23


def pieces(part: MeshPart, most_vertices: int = MOST_VERTICES) -> Iterator[MeshPart]:
    """The part in pieces of at most ``most_vertices``, each with the vertices of its own faces."""
    if len(part.vertices_m) <= most_vertices:
        yield part
        return
    step = max(1, most_vertices // 3)
    for start in range(0, len(part.faces), step):
        yield part.over(part.faces[start : start + step])


def thresholded(part: MeshPart) -> NDArray[np.uint8]:
    """The part's texture with alpha 0 or 255, or without alpha where the part is opaque.

    Texels that are not drawn take the mean colour of those that are: filtering mixes them in at the
    edges and in every mip level, and their own colour is arbitrary.
    """
    assert part.texture is not None
    if part.texture.shape[2] == 3 or part.alpha_cutoff is None:
        return np.ascontiguousarray(part.texture[..., :3])
    alpha = part.texture[..., 3] / 255.0 * (part.base_color[3] / 255.0)
    drawn = alpha >= part.alpha_cutoff
    rgba = np.dstack([part.texture[..., :3], np.where(drawn, 255, 0).astype(np.uint8)])
    rgba[~drawn, :3] = rgba[drawn, :3].mean(axis=0)
    return rgba
