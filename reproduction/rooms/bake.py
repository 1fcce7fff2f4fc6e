"""Baking of lit items into a textured mesh, as a scanner delivers one.

Pictures lie in square textures; the charts are the patches, so no unwrapping is needed.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from reproduction.rooms.lighting import Lighting, baked, exposure_of, received
from reproduction.rooms.scan import (
    Grid,
    RoomSurface,
    Scanner,
    albedo_of,
    jittered,
    scanned,
    seen_faces,
    surface_of,
)
from synfeal.effects.files import LIGHT_GROUPS
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.objects.patches import Item, Patch, Points, bilinear

log = logging.getLogger("synfeal")


def scanned_mesh(
    rng: np.random.Generator, item: Item, lighting: Lighting, scanner: Scanner
) -> TexturedMesh:
    """Light every patch, scan the whole, and lay the pictures out in textures of 4096 a side.

    Light falls on the clean surfaces; the scan then rounds and bends them and leaves out what the
    scanner could not see. Every texture becomes one part.

    Args:
        rng: Source of the scan's noise; the same state gives the same geometry as
            :func:`light_shares`.
        item: Everything in the room, walls included.
        lighting: Sources of light.
        scanner: Settings of the scan.
    """
    surface = surface_of(rng, item.patches, scanner.cell_m)
    log.info("%d patches, %d faces", len(item.patches), len(surface.faces))
    tones = surface.per_patch(baked(surface, *_reflecting(surface, item.patches), lighting))
    pictures = list(map(_lit, item.patches, surface.grids, tones))
    points, shares = _moved(rng, surface, scanned(rng, surface, scanner))
    seen = seen_faces(points, surface.faces, scanner.stations_m)
    log.info("%.1f %% of the faces are seen by a station", 100 * seen.mean())
    return _textured(surface, points, shares, seen, pictures)


def light_shares(
    rng: np.random.Generator, item: Item, lighting: Lighting, scanner: Scanner
) -> dict[str, TexturedMesh]:
    """Bake by which group of sources each vertex of the scan is lit.

    What shines by itself belongs to the group of the lamp that is nearest to it.

    Args:
        rng: Source of the scan's noise; the same state gives the same geometry as
            :func:`scanned_mesh`.
        item: Everything in the room, walls included.
        lighting: Sources of light.
        scanner: Settings of the scan.

    Returns:
        The scan by group, without pictures. Vertex colours are the group's share of the light in
        each channel, 255 for all of it; those of all groups add up to 255.
    """
    surface = surface_of(rng, item.patches, scanner.cell_m)
    albedo, glow = _reflecting(surface, item.patches)
    nearest = np.array([_nearest_group(patch, lighting) for patch in item.patches])
    group_of = np.repeat(nearest, [grid.n_points for grid in surface.grids])
    own_glow = {group: glow * (group_of == group) for group in LIGHT_GROUPS}
    light = [received(surface, albedo, own_glow[g], lighting.of_group(g)) for g in LIGHT_GROUPS]
    exposure = exposure_of(np.asarray(sum(light)))
    shown = [
        each * (exposure * (1 - glow))[:, None] + own_glow[group][:, None]
        for group, each in zip(LIGHT_GROUPS, light, strict=True)
    ]
    *others, _ = np.round(255 * np.stack(shown) / np.maximum(sum(shown), 1e-9)).astype(np.uint8)
    points, _ = _moved(rng, surface, scanned(rng, surface, scanner))
    faces = surface.faces[seen_faces(points, surface.faces, scanner.stations_m)]
    # The last is what remains, so that all together are 1 whatever is rounded.
    shares = [*others, np.clip(255 - np.sum(others, axis=0, dtype=int), 0, 255).astype(np.uint8)]
    return {
        group: TexturedMesh((MeshPart(group, points, faces, vertex_rgb=share).over(faces),))
        for group, share in zip(LIGHT_GROUPS, shares, strict=True)
    }


def _nearest_group(patch: Patch, lighting: Lighting) -> str:
    middle = patch.points_m.reshape(-1, 3).mean(axis=0)
    lamps = [(np.linalg.norm(middle - lamp.position_m), lamp.group) for lamp in lighting.lamps]
    return min(lamps)[1] if lamps else LIGHT_GROUPS[0]


def _moved(
    rng: np.random.Generator, surface: RoomSurface, points_m: Points
) -> tuple[Points, list[NDArray[np.float64]]]:
    """Move vertices (V, 3) unevenly; also return their places on the picture of each patch."""
    pieces = zip(surface.grids, surface.per_patch(points_m), strict=True)
    points, shares = zip(*(jittered(rng, grid, piece) for grid, piece in pieces), strict=True)
    return np.concatenate(points), list(shares)


def _reflecting(
    surface: RoomSurface, patches: Sequence[Patch]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Compute linear albedo (V, 3) and glow (V,) at the vertices."""
    pairs = list(zip(patches, surface.grids, strict=True))
    albedo = np.concatenate([albedo_of(patch, grid).reshape(-1, 3) for patch, grid in pairs])
    glow = np.concatenate([np.full(grid.n_points, p.glow, np.float32) for p, grid in pairs])
    return albedo, glow


def _lit(patch: Patch, grid: Grid, tone: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Light the picture (H, W, 3) by interpolating the light at the vertices."""
    height_px, width_px = patch.picture.shape[:2]
    rows, columns = (
        np.interp((np.arange(px) + 0.5) / px, shares, np.arange(len(shares)))
        for px, shares in ((height_px, grid.rows), (width_px, grid.columns))
    )
    factor = bilinear(tone, rows, columns) * (1 - patch.glow) + patch.glow
    return np.round(np.minimum(patch.picture * factor, 255)).astype(np.uint8)


def _textured(
    surface: RoomSurface,
    points_m: Points,
    shares: Sequence[NDArray[np.float64]],
    seen: NDArray[np.bool_],
    pictures: Sequence[NDArray[np.uint8]],
) -> TexturedMesh:
    """Build the mesh of the seen faces, one part for each texture."""
    places, textures = laid_out(pictures)
    uv = []
    for share, picture, (atlas, *corner) in zip(shares, pictures, places, strict=True):
        sides = textures[atlas].shape[:2]
        row, column = ((corner + share * picture.shape[:2]) / sides).T
        uv.append(np.stack([column, 1 - row], axis=-1))  # its origin is at the bottom left
    atlas_of_face = np.repeat([place[0] for place in places], surface.n_faces)
    parts = []
    for index, texture in enumerate(textures):
        faces = surface.faces[seen & (atlas_of_face == index)]
        whole = MeshPart(f"scan-{index}", points_m, faces, np.concatenate(uv), texture)
        parts.append(whole.over(faces))
    return TexturedMesh(tuple(parts))


ATLAS_PX = 4096
GUTTER_PX = 8  # repeated rim around each picture; what mipmaps and filters may reach into

Size = tuple[int, ...]
Pixels = NDArray[np.uint8]


def pack(sizes_px: Sequence[Size]) -> tuple[list[tuple[int, int, int]], list[Size]]:
    """Pack rectangles (height, width) on shelves of as many atlases as are needed.

    Returns:
        The atlas, row and column of every picture's top-left corner, and the atlases' sizes.

    Raises:
        ValueError: a picture is larger than an atlas.
    """
    places = [(0, 0, 0)] * len(sizes_px)
    atlases: list[Size] = []
    top = shelf = column = used = 0
    for index in sorted(range(len(sizes_px)), key=lambda index: (-sizes_px[index][0], index)):
        height, width = sizes_px[index]
        if max(height, width) > ATLAS_PX:
            raise ValueError(f"a picture of {width} x {height} px; an atlas has {ATLAS_PX} a side")
        if column + width > ATLAS_PX:
            top, shelf, column = top + shelf, 0, 0
        if top + height > ATLAS_PX:
            atlases.append((_rounded_up(top), _rounded_up(used)))
            top = shelf = column = used = 0
        places[index] = (len(atlases), top, column)
        column, shelf = column + width, max(shelf, height)
        used = max(used, column)
    atlases.append((_rounded_up(top + shelf), _rounded_up(used)))
    return places, atlases


def _rounded_up(side_px: int) -> int:
    return min(ATLAS_PX, -(-side_px // 16) * 16)


def laid_out(pictures: Sequence[Pixels]) -> tuple[list[tuple[int, int, int]], list[Pixels]]:
    """Lay out pictures (H, W, 3) in atlases; return where each begins, and the textures."""
    rim = ((GUTTER_PX, GUTTER_PX), (GUTTER_PX, GUTTER_PX), (0, 0))
    padded = [np.pad(picture, rim, mode="edge") for picture in pictures]
    places, atlases = pack([picture.shape[:2] for picture in padded])
    textures = [np.full((*size, 3), 128, np.uint8) for size in atlases]
    for picture, (atlas, row, column) in zip(padded, places, strict=True):
        height, width = picture.shape[:2]
        textures[atlas][row : row + height, column : column + width] = picture
    return [(atlas, row + GUTTER_PX, column + GUTTER_PX) for atlas, row, column in places], textures
