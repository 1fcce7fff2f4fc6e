"""Write a furnished room with painted walls as GLB, by trimesh alone: ``smoke_room.py FILE``."""

import sys

import numpy as np
import trimesh
from PIL import Image

SIZE_PX = 1024


def painting(rng):
    """Draw rectangles of all sizes, whose corners features are found at."""
    pixels = np.full((SIZE_PX, SIZE_PX, 3), 200, np.uint8)
    for size in np.geomspace(300, 12, 500).astype(int):
        row, column = rng.integers(0, SIZE_PX - size, 2)
        height, width = rng.integers(size // 2, size + 1, 2)
        pixels[row : row + height, column : column + width] = rng.integers(0, 256, 3)
    return Image.fromarray(pixels)


def painted_box(extents_m, center_m, rng, inwards=False):
    """Make a box with the whole painting on each of its sides."""
    box = trimesh.creation.box(extents_m)
    if inwards:
        box.invert()
    box.unmerge_vertices()
    normals = np.repeat(box.face_normals, 3, axis=0)
    across = np.argsort(np.abs(normals), axis=1)[:, :2]  # the two axes along the side
    uv = np.take_along_axis(box.vertices / extents_m + 0.5, np.sort(across, axis=1), axis=1)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=painting(rng))
    box.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    box.apply_translation(center_m)
    return box


def main():
    """Write the room: 6 x 5 x 3 m, a table and a cupboard."""
    rng = np.random.default_rng(0)
    parts = [
        painted_box((6.0, 5.0, 3.0), (0.0, 0.0, 1.5), rng, inwards=True),
        painted_box((1.6, 0.8, 0.7), (1.5, 1.2, 0.35), rng),
        painted_box((0.6, 1.2, 2.0), (-2.6, -1.0, 1.0), rng),
    ]
    trimesh.Scene(parts).export(sys.argv[1])


main()
