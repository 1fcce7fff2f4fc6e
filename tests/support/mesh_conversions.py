"""A scene written as OBJ and as vertex-coloured PLY, independently of what the loader does."""

from dataclasses import replace

import numpy as np
import trimesh
from PIL import Image
from scipy.ndimage import map_coordinates


def write_obj_scene(folder, mesh):
    """OBJ, MTL and PNG textures; what is cut out of a texture is cut out by its alpha."""
    obj, mtl = ["mtllib scene.mtl"], []
    first = 1
    for index, part in enumerate(mesh.parts):
        mtl += mtl_lines(folder, part, index)
        uv = np.zeros((len(part.vertices_m), 2)) if part.uv is None else part.uv
        obj.append(f"usemtl material{index}")
        obj += map("v {0[0]:.9g} {0[1]:.9g} {0[2]:.9g}".format, part.vertices_m)
        obj += map("vt {0[0]:.9g} {0[1]:.9g}".format, uv)
        obj += map("f {0[0]}/{0[0]} {0[1]}/{0[1]} {0[2]}/{0[2]}".format, part.faces + first)
        first += len(part.vertices_m)
    (folder / "scene.mtl").write_text("\n".join(mtl) + "\n")
    (folder / "scene.obj").write_text("\n".join(obj) + "\n")
    return folder / "scene.obj"


def mtl_lines(folder, part, index):
    red, green, blue = part.base_color[:3] / 255.0
    lines = [f"newmtl material{index}", f"Kd {red} {green} {blue}"]
    if part.texture is None:
        return lines
    name = f"texture{index}.png"
    pixels = part.texture
    if part.alpha_cutoff is not None:
        drawn = pixels[..., 3] / 255.0 >= part.alpha_cutoff
        pixels = np.dstack([pixels[..., :3], np.where(drawn, 255, 0).astype(np.uint8)])
        lines.append(f"map_d {name}")
    Image.fromarray(pixels).save(folder / name, compress_level=1)
    return [*lines, f"map_Kd {name}"]


def write_colored_ply(path, mesh, spacing_m):
    """PLY of a scene, with vertices at most ``spacing_m`` apart that carry its textures."""
    pieces, colors = [], []
    for part in mesh.parts:
        mapped = part if part.uv is not None else replace(part, uv=part.vertices_m[:, :2] * 0)
        corners = bisected(mapped, spacing_m)
        pieces.append(corners.reshape(-1, 5)[:, :3])
        colors.append(vertex_colors(part, corners, spacing_m))
    points = np.concatenate(pieces)
    faces = np.arange(len(points)).reshape(-1, 3)
    soup = trimesh.Trimesh(points, faces, vertex_colors=np.concatenate(colors), process=False)
    path.write_bytes(soup.export(file_type="ply"))
    return path


def vertex_colors(part, corners, spacing_m):
    """Colours (N, 3): the texture averaged over about half a spacing around each corner."""
    if part.texture is None:
        return np.broadcast_to(part.base_color[:3], (3 * len(corners), 3)).copy()
    height, width = part.texture.shape[:2]
    surface_m2 = areas(corners[..., :3]).sum()
    texels = areas(np.pad(corners[..., 3:] * (width, height), ((0, 0), (0, 0), (0, 1)))).sum()
    factor = max(1, int(np.sqrt(texels / surface_m2) * spacing_m / 2))
    smaller = (max(1, width // factor), max(1, height // factor))
    small = np.asarray(Image.fromarray(part.texture).resize(smaller, Image.Resampling.BOX), float)
    at = np.stack([1 - corners[..., 4].ravel() % 1, corners[..., 3].ravel() % 1]) - 1e-9
    where = at * np.array(small.shape[:2])[:, None] - 0.5
    colors = [map_coordinates(small[..., c], where, order=1, mode="grid-wrap") for c in range(3)]
    return np.round(np.stack(colors, axis=1) * (part.base_color[:3] / 255)).astype(np.uint8)


def areas(corners):
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(sides, axis=1) / 2)


def bisected(part, spacing_m):
    """Corners (F, 3, 5), position and texture coordinates, cut at the longest edge until short."""
    assert part.uv is not None
    corners = np.dstack([part.vertices_m[part.faces], part.uv[part.faces]])
    done = []
    while len(corners):
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1)[..., :3] - corners[..., :3], axis=2)
        is_long = lengths.max(axis=1) > spacing_m
        done.append(corners[~is_long])
        order = (lengths[is_long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(corners[is_long], order[..., None], axis=1).transpose(1, 0, 2)
        middle = (a + b) / 2
        corners = np.stack([np.concatenate(x) for x in ((a, middle), (middle, b), (c, c))], axis=1)
    return np.concatenate(done)
