"""A textured mesh with less detail: smaller textures, or fewer triangles that keep theirs.

Triangles are taken away by joining vertices to neighbours that are there already, so what remains
has its own place, texture coordinates and colour. Copies of a vertex on both sides of a texture
seam, or of the border between two parts, move together along it: nothing tears, and no triangle
reaches into another chart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.triangles import weld

NO_LIMIT = 1e9  # of the error, in diameters of the mesh: the number of faces alone decides


def with_smaller_textures(mesh: TexturedMesh, factor: int) -> TexturedMesh:
    """The mesh with every texture ``factor`` times smaller along each axis, averaged over boxes.

    Colours are weighted with their alpha: what is cut out does not shine through.
    """
    return replace(mesh, parts=tuple(_smaller_texture(part, factor) for part in mesh.parts))


def _smaller_texture(part: MeshPart, factor: int) -> MeshPart:
    if part.texture is None:
        return part
    rgb, alpha = part.texture[..., :3].astype(np.float32), part.texture[..., 3:]
    if not alpha.size:
        return replace(part, texture=_rounded(_box_means(rgb, factor)))
    cover = _box_means(alpha.astype(np.float32), factor)
    visible = _box_means(rgb * alpha, factor) / np.maximum(cover, 1e-3)
    return replace(part, texture=_rounded(np.concatenate([visible, cover], axis=2)))


def _box_means(image: NDArray[np.float32], factor: int) -> NDArray[np.float32]:
    """Means of an image (H, W, C); not rounded on the way, as Pillow does with 8 bits."""
    size = tuple(max(1, round(side / factor)) for side in image.shape[1::-1])
    channels = (Image.fromarray(np.ascontiguousarray(c)) for c in np.moveaxis(image, 2, 0))
    return np.stack([np.asarray(c.resize(size, Image.Resampling.BOX)) for c in channels], axis=2)


def _rounded(image: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.round(image).clip(0, 255).astype(np.uint8)


def with_fewer_faces(mesh: TexturedMesh, n_faces: int) -> TexturedMesh:
    """The mesh with about ``n_faces`` triangles, which use a subset of its vertices.

    More are left where corners of charts, which never move, forbid to go on. Only the shape decides
    which vertices go: where a texture is stretched unevenly over a smooth surface, it shifts.

    Raises:
        ImportError: the package ``meshoptimizer`` is not installed.
    """
    vertices_m, faces = mesh.merged()
    kept = _simplified(vertices_m, faces, n_faces)
    first = np.cumsum([0, *(len(part.vertices_m) for part in mesh.parts)])
    of_part = np.searchsorted(first, kept[:, 0], side="right") - 1
    parts = (
        part.over(kept[of_part == index] - first[index])
        for index, part in enumerate(mesh.parts)
        if (of_part == index).any()
    )
    return replace(mesh, parts=tuple(parts))


def _simplified(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int64], n_faces: int
) -> NDArray[np.int64]:
    """Faces (F, 3) over the same vertices (V, 3), about ``n_faces`` of them."""
    # The other function, which would weigh texture coordinates too, crashes as published: its
    # wrapper (0.2.30a0) does not say which types of numbers the library takes.
    from meshoptimizer import simplify

    places_m, index = weld(vertices_m - vertices_m.mean(axis=0))  # copies are alike to the bit
    kept = np.empty(faces.size, np.uint32)
    count = simplify(
        kept,
        faces.reshape(-1).astype(np.uint32),
        places_m[index].astype(np.float32),
        target_index_count=3 * n_faces,
        target_error=NO_LIMIT,
    )
    return kept[:count].reshape(-1, 3).astype(np.int64)
