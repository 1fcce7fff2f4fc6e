"""Patches and light in, textured mesh parts out: every part is one texture atlas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.scenes.lighting import Lighting
from synfeal.scenes.patches import Block, Item, Patch, bilinear, joined

ATLAS_PX = 2048
GUTTER_PX = 6  # repeated rim around each picture; what mipmaps and filters may reach into
LIGHT_SPACING_M = 0.08
CHUNK = 1 << 13  # surface points lit at once; fits the cache


def baked_mesh(parts: Mapping[str, Item], lighting: Lighting) -> TexturedMesh:
    """Light every patch and lay out the patches of each named item in one texture."""
    everything = joined(parts.values())
    tones = iter(_tones(everything.patches, everything.blocks, lighting))
    return TexturedMesh(
        tuple(
            _part(name, item.patches, [_lit(patch, next(tones)) for patch in item.patches])
            for name, item in parts.items()
        )
    )


def _tones(
    patches: Sequence[Patch], blocks: Sequence[Block], lighting: Lighting
) -> list[NDArray[np.float32]]:
    """Light (A, B, 3) on a coarse grid over every patch, computed for all of them together."""
    samples = [patch.sample(LIGHT_SPACING_M) for patch in patches]
    points = np.concatenate([at.reshape(-1, 3) for at, _ in samples]).astype(np.float32)
    normals = np.concatenate([normal.reshape(-1, 3) for _, normal in samples]).astype(np.float32)
    starts = range(0, len(points), CHUNK)
    tones = np.concatenate(
        [lighting.tone(points[i : i + CHUNK], normals[i : i + CHUNK], blocks) for i in starts]
    )
    ends = np.cumsum([at.shape[0] * at.shape[1] for at, _ in samples])
    pieces = np.split(tones, ends[:-1])
    return [piece.reshape(at.shape) for piece, (at, _) in zip(pieces, samples, strict=True)]


def _lit(patch: Patch, tone: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The picture (H, W, 3) under the light (A, B, 3), which is interpolated."""
    height_px, width_px = patch.picture.shape[:2]
    rows = (np.arange(height_px) + 0.5) / height_px * (tone.shape[0] - 1)
    columns = (np.arange(width_px) + 0.5) / width_px * (tone.shape[1] - 1)
    factor = bilinear(tone, rows, columns) * (1 - patch.glow) + patch.glow
    return np.round(np.clip(patch.picture * factor, 0, 1) * 255).astype(np.uint8)


def pack(sizes_px: Sequence[tuple[int, int]]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Shelf packing of (height, width): every top-left corner (row, column) and the atlas' size.

    Raises:
        ValueError: they do not fit into one atlas.
    """
    order = sorted(range(len(sizes_px)), key=lambda index: (-sizes_px[index][0], index))
    corners = [(0, 0)] * len(sizes_px)
    shelf_top = shelf_height = column = width_used = 0
    for index in order:
        height, width = sizes_px[index]
        if column + width > ATLAS_PX:
            shelf_top, shelf_height, column = shelf_top + shelf_height, 0, 0
        corners[index] = (shelf_top, column)
        column += width
        shelf_height = max(shelf_height, height)
        width_used = max(width_used, column)
    total = shelf_top + shelf_height
    if total > ATLAS_PX or width_used > ATLAS_PX:
        raise ValueError(f"pictures need {width_used} x {total} px, an atlas has {ATLAS_PX} a side")
    return corners, (-(-total // 16) * 16, -(-width_used // 16) * 16)


def _part(name: str, patches: Sequence[Patch], pictures: list[NDArray[np.uint8]]) -> MeshPart:
    padded = [
        np.pad(picture, ((GUTTER_PX,) * 2, (GUTTER_PX,) * 2, (0, 0)), mode="edge")
        for picture in pictures
    ]
    corners, (height, width) = pack([(picture.shape[0], picture.shape[1]) for picture in padded])
    texture = np.full((height, width, 3), 128, np.uint8)
    vertices, faces, uv, count = [], [], [], 0
    for patch, picture, (row, column) in zip(patches, padded, corners, strict=True):
        texture[row : row + picture.shape[0], column : column + picture.shape[1]] = picture
        inner_height, inner_width = patch.picture.shape[:2]
        v = 1 - (row + GUTTER_PX + patch.row_shares * inner_height) / height
        u = (column + GUTTER_PX + patch.column_shares * inner_width) / width
        uv.append(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
        vertices.append(patch.points_m.reshape(-1, 3))
        faces.append(_grid_faces(patch.points_m) + count)
        count += len(vertices[-1])
    return MeshPart(
        name, np.concatenate(vertices), np.concatenate(faces), np.concatenate(uv), texture
    )


def _grid_faces(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Triangles (F, 3) of a grid, counter-clockwise from its front, without those of no area."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (
        part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    )
    faces = np.concatenate([np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)])
    corner = points.reshape(-1, 3)[faces]
    doubled = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    solid: NDArray[np.int64] = faces[doubled > 1e-10].astype(np.int64)
    return solid
