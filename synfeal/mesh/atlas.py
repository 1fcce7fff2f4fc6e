"""Vertex colours baked into a texture, so that a mesh may have fewer triangles than colours.

A scan fused from photographs has a colour at each vertex and a vertex at each voxel: its triangles
are as fine as its texture would be, on flat walls too. Here a simplified mesh is cut into charts
that face one axis of the world each, the charts are laid out in one image, and each texel takes the
colour of the full mesh beside it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import distance_transform_edt
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from synfeal.mesh.model import MeshPart

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
GUTTER_PX = 2  # texels around each chart that repeat its rim, as filtering mixes neighbours
CHART_M = 1.0  # charts end at the cells of such a grid: longer ones leave more of the image empty
NEIGHBOURS = 4  # vertices that a texel is the weighted mean of
# A vertex on the other side of a thin sheet counts as this many texels away.
OTHER_SIDE_TEXELS = 2.0


def texel_size_m(part: MeshPart) -> float:
    """Return the median edge length of a part in metres, the spacing of its colours."""
    corners = part.vertices_m[part.faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return float(np.median(edges))


def with_baked_colors(reduced: MeshPart, full: MeshPart, texel_m: float) -> MeshPart:
    """Give a simplified part a texture with the vertex colours of the full one.

    Args:
        reduced: Few triangles.
        full: The part it was simplified from; has ``vertex_rgb`` (V, 3).
        texel_m: Side of a texel, metres.

    Returns:
        The triangles of ``reduced`` with texture coordinates, copies of vertices where charts meet.
    """
    charts = _charts(reduced, texel_m)
    pixels, points_m, normals = _texels(charts, reduced)
    image = np.zeros((*charts.size, 3), np.uint8)
    image[pixels[:, 1], pixels[:, 0]] = _colors_at(points_m, normals, full, texel_m)
    filled = np.zeros(charts.size, np.bool_)
    filled[pixels[:, 1], pixels[:, 0]] = True
    row, column = distance_transform_edt(~filled, return_distances=False, return_indices=True)
    height, width = charts.size
    uv = charts.uv_px / [width, height]
    uv[:, 1] = 1.0 - uv[:, 1]  # rows of an image begin at the top
    return replace(
        reduced,
        vertices_m=reduced.vertices_m[charts.vertices],
        faces=charts.faces,
        uv=uv,
        texture=image[row, column],
        vertex_rgb=None,
    )


class _Charts(NamedTuple):
    """Triangles laid out in an image."""

    vertices: Ints  # (W,) which vertex of the mesh each corner of a chart is
    faces: Ints  # (F, 3) indices into these, in the order of the mesh
    uv_px: Floats  # (W, 2) column and row of each in the image, texels
    size: tuple[int, int]  # height and width of the image


def _charts(part: MeshPart, texel_m: float) -> _Charts:
    corners = part.vertices_m[part.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(normals).argmax(axis=1)
    sign = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] > 0
    cell = np.floor(corners.mean(axis=1) / CHART_M).astype(np.int64)
    kind = np.column_stack([axis, sign, cell])
    _, kind_of = np.unique(kind, axis=0, return_inverse=True)
    chart_of = _connected(part.faces, kind_of.reshape(-1))

    pair = part.faces * np.int64(chart_of.max() + 1) + chart_of[:, None]
    pairs, index = np.unique(pair, return_inverse=True)
    vertices, chart = np.divmod(pairs, chart_of.max() + 1)
    axis_of_chart = np.zeros(chart_of.max() + 1, np.int64)
    axis_of_chart[chart_of] = axis
    across = np.array([[1, 2], [2, 0], [0, 1]])[axis_of_chart[chart]]
    flat = np.take_along_axis(part.vertices_m[vertices], across, axis=1) / texel_m
    low = np.full((len(axis_of_chart), 2), np.inf)
    np.minimum.at(low, chart, flat)
    high = np.full((len(axis_of_chart), 2), -np.inf)
    np.maximum.at(high, chart, flat)
    sides = np.ceil(high - low).astype(np.int64) + 1 + 2 * GUTTER_PX
    places, size = _shelves(sides)
    uv_px = flat - low[chart] + places[chart] + GUTTER_PX + 0.5
    return _Charts(vertices, index.reshape(-1, 3).astype(np.int64), uv_px, size)


def _connected(faces: Ints, kind: Ints) -> Ints:
    """Number the chart of each face: faces of one kind that share edges, directly or by others."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(faces)), 3)
    kinds = kind[owner]
    order = np.lexsort((edges[:, 1], edges[:, 0], kinds))
    edges, owner, kinds = edges[order], owner[order], kinds[order]
    same = (edges[1:] == edges[:-1]).all(axis=1) & (kinds[1:] == kinds[:-1])
    first, second = owner[:-1][same], owner[1:][same]
    shape = (len(faces), len(faces))
    graph = sparse.coo_matrix((np.ones(len(first), np.int8), (first, second)), shape)
    chart: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
    return chart


def _shelves(sides: Ints) -> tuple[Ints, tuple[int, int]]:
    """Place rectangles of sides (N, 2), width and height, on shelves of an image.

    Returns:
        The upper left corner of each, column and row, and height and width of the image.
    """
    width = max(int(np.ceil(np.sqrt(1.1 * sides.prod(axis=1).sum()))), int(sides[:, 0].max()))
    places = np.empty_like(sides)
    x = y = shelf = 0
    for index in np.lexsort((np.arange(len(sides)), -sides[:, 1])):
        wide, high = sides[index]
        if x + wide > width:
            x, y = 0, y + shelf
        if x == 0:
            shelf = int(high)
        places[index] = x, y
        x += int(wide)
    return places, (y + shelf, width)


def _texels(charts: _Charts, part: MeshPart) -> tuple[Ints, Floats, Floats]:
    """Find texels whose centres lie on a triangle or near it.

    All within half a texel are found, and a few more beside short edges and sharp corners.

    Returns:
        Column and row (T, 2), the point of the triangle (T, 3) in metres, and its normal (T, 3).
    """
    corners_px = charts.uv_px[charts.faces]
    low = np.floor(corners_px.min(axis=1) - 0.5).astype(np.int64)
    spans = np.ceil(corners_px.max(axis=1) + 0.5).astype(np.int64) - low
    counts = spans.prod(axis=1)
    face = np.repeat(np.arange(len(counts)), counts)
    local = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    pixels = low[face] + np.column_stack([local % spans[face, 0], local // spans[face, 0]])

    a, b, c = np.moveaxis(corners_px, 1, 0)
    ab, ac = b - a, c - a
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    area[np.abs(area) < 1e-9] = 1e-9
    from_a = pixels + 0.5 - a[face]
    v = (from_a[:, 0] * ac[face, 1] - from_a[:, 1] * ac[face, 0]) / area[face]
    w = (ab[face, 0] * from_a[:, 1] - ab[face, 1] * from_a[:, 0]) / area[face]
    weights = np.column_stack([1.0 - v - w, v, w])
    # How far outside a texel's centre lies: barycentric shortfall times the height of the triangle.
    longest = np.linalg.norm(np.stack([c - b, c - a, b - a]), axis=2).max(axis=0)
    outside_px = -weights.min(axis=1) * (np.abs(area) / np.maximum(longest, 1e-9))[face]
    near = outside_px <= 0.5
    face, pixels, weights = face[near], pixels[near], weights[near]
    order = np.argsort(-outside_px[near], kind="stable")  # those inside are written last
    face, pixels, weights = face[order], pixels[order], np.clip(weights[order], 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    corners_m = part.vertices_m[part.faces[face]]
    points_m = np.einsum("tk,tkd->td", weights, corners_m)
    normals = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    return pixels, points_m, _unit(normals)


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-30))


def _colors_at(
    points_m: Floats, normals: Floats, full: MeshPart, texel_m: float
) -> NDArray[np.uint8]:
    """Look up colours (T, 3) of the full mesh at points (T, 3) with normals (T, 3)."""
    assert full.vertex_rgb is not None
    corners = full.vertices_m[full.faces]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    vertex_normals = np.zeros_like(full.vertices_m)
    for corner in range(3):
        np.add.at(vertex_normals, full.faces[:, corner], face_normals)
    reach_m = OTHER_SIDE_TEXELS * texel_m / 2.0
    known = np.column_stack([full.vertices_m, reach_m * _unit(vertex_normals)])
    distance, index = cKDTree(known).query(
        np.column_stack([points_m, reach_m * normals]), NEIGHBOURS
    )
    weight = 1.0 / (distance**2 + (0.25 * texel_m) ** 2)
    weight /= weight.sum(axis=1, keepdims=True)
    rgb = np.einsum("tk,tkc->tc", weight, full.vertex_rgb[index].astype(np.float64))
    return np.asarray(np.rint(rgb), np.uint8)
