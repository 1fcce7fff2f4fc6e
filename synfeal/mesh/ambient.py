"""Ambient light for meshes without texture: vertices are darker where surfaces are near.

A mesh without textures is flat where it has one colour. Here its vertices get what a soft light
from everywhere would leave: less in corners and behind furniture (ambient occlusion; Zhukov, Iones
and Kronin, An ambient light illumination model, EGWR 1998, whose obscurances fade with distance),
and more on surfaces along one axis, so that walls differ where they meet. The light is in the scene
and the same from everywhere, as that of a texture is. Large triangles are cut, as colours change at
vertices alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import cross

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster

Floats = NDArray[np.float64]

N_RAYS = 48  # from each side of a vertex
HALF_M = 1.0  # what is so far away takes half of the light of its direction
OUTSIDE = 0.1  # more of the rays of a side leave the mesh than of the other: that is outdoors
CAVITY_M = 1.0  # a side of which only 15 % of the rays get farther is the inside of a wall
LONGEST_EDGE_M = 0.2
MOST_PIECES = 150_000  # triangles after cutting, about: in large scenes longer edges stay
AXIS: Floats = np.array([0.8, 0.2, 0.32**0.5])  # unit length
# Brightness of a free surface is MIDDLE + SLOPE * |cosine to the axis|: 0.75 to 1.
MIDDLE, SLOPE = 0.75, 0.25
LEAST = 0.15  # brightness of what is shut in
LIFT = 1e-4  # rays start this share of the mesh's extent above a vertex
INWARDS = 0.1  # and this share of the way to the middle of its triangles
AT_ONCE = 20_000  # vertices whose rays are cast together


def with_ambient_light(mesh: TexturedMesh) -> TexturedMesh:
    """Darken the colours of a mesh as soft light from everywhere would.

    Args:
        mesh: World frame, z up, metres.

    Returns:
        The same surface in more triangles. Each part has vertex colours, which multiply its texture
        or its base colour.
    """
    vertices_m, faces = mesh.merged()
    caster = RayCaster(vertices_m, faces)
    lift_m = LIFT * float(np.ptp(mesh.bounds_m, axis=0).max())
    area_m2 = float(np.linalg.norm(cross(vertices_m[faces]), axis=1).sum() / 2.0)
    # Pieces are about half squares of three quarters of the longest edge.
    longest_m = max(LONGEST_EDGE_M, float(np.sqrt(3.5 * area_m2 / MOST_PIECES)))
    parts = (_lit(cut_part(part, longest_m), caster, lift_m) for part in mesh.parts)
    return replace(mesh, parts=tuple(parts))


def cut_part(part: MeshPart, longest_m: float) -> MeshPart:
    """Cut the triangles of a part in halves until no edge is longer.

    Neighbours that share an edge cut it alike, so no gap opens between them. Corners of triangles
    that face different ways are vertices of their own. A part without long edges stays as it is.
    """
    edges = np.roll(part.vertices_m[part.faces], -1, axis=1) - part.vertices_m[part.faces]
    if np.linalg.norm(edges, axis=2).max() <= longest_m:
        return part
    columns = [part.vertices_m, part.uv, part.vertex_rgb]
    values = np.hstack([each.astype(np.float64) for each in columns if each is not None])
    corners = values[part.faces]
    done = []
    while len(corners):
        sides = np.roll(corners[..., :3], -1, axis=1) - corners[..., :3]
        length_m = np.linalg.norm(sides, axis=2)
        is_long = length_m.max(axis=1) > longest_m
        done.append(corners[~is_long])
        # Turned so that the longest edge is the first.
        order = (length_m[is_long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        turned = np.take_along_axis(corners[is_long], order[..., None], axis=1)
        a, b, c = np.moveaxis(turned, 1, 0)
        middle = (a + b) / 2.0
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        corners = np.concatenate(halves)
    return _indexed(part, np.concatenate(done))


def _indexed(part: MeshPart, corners: Floats) -> MeshPart:
    """Build the part from corners (F, 3, K), joining equal ones that face alike."""
    facing = np.round(8.0 * _normals(corners[..., :3]))
    keys = np.concatenate([corners, np.repeat(facing[:, None], 3, axis=1)], axis=2)
    rows, index = np.unique(keys.reshape(-1, keys.shape[2]), axis=0, return_inverse=True)
    has_uv = part.uv is not None
    rgb = None
    if part.vertex_rgb is not None:
        start = 5 if has_uv else 3
        rgb = np.round(rows[:, start : start + 3]).astype(np.uint8)
    return replace(
        part,
        vertices_m=np.ascontiguousarray(rows[:, :3]),
        faces=index.reshape(-1, 3).astype(np.int64),
        uv=np.ascontiguousarray(rows[:, 3:5]) if has_uv else None,
        vertex_rgb=rgb,
    )


def _lit(part: MeshPart, caster: RayCaster, lift_m: float) -> MeshPart:
    normals = vertex_normals(part)
    # A vertex in the corner of a room lies on both walls: its rays start within its own triangles.
    starts_m = part.vertices_m + INWARDS * (_centres(part) - part.vertices_m)
    bright = np.empty(len(part.vertices_m))
    for start in range(0, len(bright), AT_ONCE):
        some = slice(start, start + AT_ONCE)
        bright[some] = brightness(caster, starts_m[some], normals[some], lift_m)
    white = np.full((len(bright), 3), 255, np.uint8)
    own = white if part.vertex_rgb is None else part.vertex_rgb
    return replace(part, vertex_rgb=np.round(bright[:, None] * own).astype(np.uint8))


def _centres(part: MeshPart) -> Floats:
    """Average the centres of the triangles around each vertex: (V, 3)."""
    middle_m = part.vertices_m[part.faces].mean(axis=1)
    total, count = np.zeros_like(part.vertices_m), np.zeros(len(part.vertices_m))
    for corner in range(3):
        np.add.at(total, part.faces[:, corner], middle_m)
        np.add.at(count, part.faces[:, corner], 1.0)
    return np.asarray(total / count[:, None])


def vertex_normals(part: MeshPart) -> Floats:
    """Return unit normals (V, 3): means over the triangles of each vertex, weighted by area."""
    weighted = cross(part.vertices_m[part.faces])
    total = np.zeros_like(part.vertices_m)
    for corner in range(3):
        np.add.at(total, part.faces[:, corner], weighted)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30))


def brightness(caster: RayCaster, points_m: Floats, normals: Floats, lift_m: float) -> Floats:
    """Measure how much light from everywhere reaches points of a surface.

    Args:
        caster: Rays against the mesh.
        points_m: Points (N, 3) on it.
        normals: Unit normals (N, 3); which side they point to does not matter.
        lift_m: Distance between the points and where their rays start.

    Returns:
        Brightness (N,), 0 to 1, of the side that cameras see: indoors where the other is outdoors,
        as walls without thickness are seen from the room; else the more open one, as nobody looks
        out of the inside of a wall or of a block.
    """
    local = hemisphere_directions(N_RAYS)
    openness, escaped, reach_m = np.empty((3, 2, len(points_m)))
    for side, up in enumerate((normals, -normals)):
        directions = _turned(local, up).reshape(-1, 3)
        starts = np.repeat(points_m + lift_m * up, N_RAYS, axis=0)
        hit_m = caster.first_hit_m(starts, directions).reshape(len(points_m), N_RAYS)
        openness[side] = np.mean(1.0 / (1.0 + HALF_M / np.maximum(hit_m, 1e-9)), axis=1)
        escaped[side] = np.mean(np.isinf(hit_m), axis=1)
        reach_m[side] = np.quantile(hit_m, 0.85, axis=1, method="lower")
    is_indoors = (escaped < escaped[::-1] - OUTSIDE) & (reach_m >= CAVITY_M)
    seen = np.where(is_indoors.any(axis=0), is_indoors.argmax(axis=0), openness.argmax(axis=0))
    cosines: Floats = np.abs(normals @ AXIS)
    light = openness[seen, np.arange(len(points_m))] * (MIDDLE + SLOPE * cosines)
    return np.asarray(LEAST + (1.0 - LEAST) * light)


def hemisphere_directions(count: int) -> Floats:
    """Return directions (count, 3) above the plane z = 0, as dense as their z (cosine-weighted)."""
    index = np.arange(count) + 0.5
    radius = np.sqrt(index / count)
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - radius**2)], 1)


def _turned(local: Floats, up: Floats) -> Floats:
    """Turn directions ``local`` (R, 3) into frames with z axes ``up`` (N, 3): (N, R, 3)."""
    # Any axis that is not along ``up`` gives the other two.
    helper = np.where(np.abs(up[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    x = np.cross(helper, up)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-30)
    frames = np.stack([x, np.cross(up, x), up], axis=1)
    return np.asarray(np.einsum("rk,nkj->nrj", local, frames))


def _normals(corners: Floats) -> Floats:
    normals = cross(corners)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30))
