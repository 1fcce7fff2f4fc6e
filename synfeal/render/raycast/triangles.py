"""Triangles that rays can hit, with the colour of every point on them.

What varies over a triangle (distance from its plane, texture coordinates, vertex colours) is linear
in space. Each is kept as one row of a matrix per triangle, which times a point in homogeneous
coordinates gives the value there. Along a ray the rows give a constant and a slope; the plane is
met where its own vanishes, and all else follows, derivatives from pixel to pixel included.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.render.pieces import thresholded
from synfeal.render.raycast.mipmaps import MipMaps

Floats = NDArray[np.float64]
Faces = NDArray[np.int64]

# A ray goes on this much, of the mesh's extent, behind what it passes: twice what the ray caster
# may be wrong by.
STEP = 2e-6
EDGE_ON = 1e-3
LEAST_ALPHA = 127.5  # of 255: what is left of cut-out textures after filtering
MOST_LAYERS = 64  # that a ray passes before it counts as lost
WHITE = np.full((1, 1, 3), 255, np.uint8)


class View(NamedTuple):
    """Where from and how finely the triangles are looked at, in their frame."""

    origin_m: Floats  # (3,) position of the camera
    per_px: Floats  # (2, 3) how rays change from pixel to pixel along x and y
    near_m: float  # least depth
    far_m: float  # greatest depth


class Points(NamedTuple):
    """Points on triangles."""

    rays: Floats  # (N, 3) through which they are seen
    face: Faces  # (N,) index of the triangle
    part: NDArray[np.intp]  # (N,) index of the drawn part
    depth_m: Floats  # (N,) along the optical axis
    # (N, 2 | 5) texture coordinates and, if any part has them, vertex colours, 0 to 1
    values: Floats


class TexturedTriangles:
    """All drawn parts of a mesh; coordinates are relative to ``centre_m``."""

    def __init__(self, mesh: TexturedMesh) -> None:
        parts = [part for part in mesh.parts if part.is_drawn]
        vertices, faces = TexturedMesh(tuple(parts)).merged()
        bounds = mesh.bounds_m
        self.centre_m: Floats = bounds.mean(axis=0)
        self._step_m = STEP * float(np.max(bounds[1] - bounds[0]))
        self._caster = RayCaster(vertices - self.centre_m, faces)
        self._rows = _rows(parts, self.centre_m)
        self._part_of = np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts])
        self._tint = np.array([part.base_color[:3] / 255.0 for part in parts])
        textures, self._texture_of = _textures(parts)
        self._has_cutouts = np.array([a.shape[2] == 4 for a in textures])[self._texture_of]
        self._textures = MipMaps(textures)

    def first_drawn(self, view: View, rays: Floats) -> tuple[Faces, Floats]:
        """The first triangle (N,) that shows on each ray, -1 for none, and its depth (N,).

        Args:
            view: where from.
            rays: (N, 3), of unit length along the optical axis.
        """
        face, depth_m = self._first_hits(view, rays, np.full(len(rays), view.near_m))
        pending = np.flatnonzero(self._is_cut_out(face))
        for _ in range(MOST_LAYERS):
            if not len(pending):
                break
            points = self.points(view, rays[pending], face[pending], depth_m[pending])
            alpha = self._texel(points, self._uv_per_px(view, points))[:, 3]
            pending = pending[alpha < LEAST_ALPHA]
            start_m = depth_m[pending] + self._step_m
            face[pending], depth_m[pending] = self._first_hits(view, rays[pending], start_m)
            pending = pending[self._is_cut_out(face[pending])]
        face[pending] = -1
        face[depth_m > view.far_m] = -1
        return face, depth_m

    def points(self, view: View, rays: Floats, face: Faces, depth_m: Floats) -> Points:
        """Where ``rays`` (N, 3) meet the triangles ``face`` (N,): exactly, given ``depth_m``."""
        rows = self._rows[face]
        constant = np.einsum("nkj,j->nk", rows, np.append(view.origin_m, 1.0))
        slope = np.einsum("nkj,nj->nk", rows[:, :, :3], rays)
        with np.errstate(divide="ignore", invalid="ignore"):
            exact_m = -constant[:, 0] / slope[:, 0]
        # A triangle seen edge-on has a plane that is met anywhere, or nowhere.
        near_m, far_m = (1.0 - EDGE_ON) * depth_m, (1.0 + EDGE_ON) * depth_m
        depth_m = np.fmax(np.fmin(exact_m, far_m), near_m)
        values = constant[:, 1:] + depth_m[:, None] * slope[:, 1:]
        return Points(rays, face, self._part_of[face], depth_m, values)

    def _uv_per_px(self, view: View, points: Points) -> Floats:
        """How u and v change along x and y, (N, 4): du/dx, dv/dx, du/dy, dv/dy."""
        gradient, depth_m = self._rows[points.face, :3, :3], points.depth_m
        slope = np.einsum("nkj,nj->nk", gradient, points.rays)
        slope[slope[:, 0] == 0.0, 0] = np.inf
        changes = []
        for step in view.per_px:
            turn = np.einsum("nkj,j->nk", gradient, step)
            away = -depth_m * turn[:, 0] / slope[:, 0]
            changes += [away * slope[:, k] + depth_m * turn[:, k] for k in (1, 2)]
        return np.stack(changes, axis=1)

    def rgb(self, view: View, points: Points) -> NDArray[np.float32]:
        """Colours (N, 3), 0 to 255."""
        tint = self._tint[points.part]
        if points.values.shape[1] == 5:
            tint = tint * np.clip(points.values[:, 2:], 0.0, 1.0)
        texel = self._texel(points, self._uv_per_px(view, points))
        return texel[:, :3] * tint.astype(np.float32)

    def _texel(self, points: Points, uv_per_px: Floats) -> NDArray[np.float32]:
        texture = self._texture_of[points.part]
        return self._textures.rgba(texture, points.values[:, :2], uv_per_px)

    def _is_cut_out(self, face: Faces) -> NDArray[np.bool_]:
        """Whether a face was hit and has holes in its texture."""
        return np.asarray((face >= 0) & self._has_cutouts[self._part_of[face]], np.bool_)

    def _first_hits(self, view: View, rays: Floats, start_m: Floats) -> tuple[Faces, Floats]:
        """First triangles at depths beyond ``start_m`` (N,), and their depths."""
        origins = view.origin_m + start_m[:, None] * rays
        distance_m, face = self._caster.first_hits(origins, rays)
        return face, start_m + distance_m / np.linalg.norm(rays, axis=1)


def _textures(parts: list[MeshPart]) -> tuple[list[NDArray[np.uint8]], NDArray[np.intp]]:
    """The textures, white for parts without, and which one each part has; shared ones once."""
    found: dict[object, int] = {}
    textures: list[NDArray[np.uint8]] = []
    texture_of = []
    for part in parts:
        key = part.texture is not None and (id(part.texture), part.alpha_cutoff, part.base_color[3])
        if key not in found:
            found[key] = len(textures)
            textures.append(WHITE if part.texture is None else thresholded(part))
        texture_of.append(found[key])
    return textures, np.array(texture_of)


def _rows(parts: list[MeshPart], centre_m: Floats) -> Floats:
    """Per triangle (F, 3 | 6, 4): distance from the plane, u, v, and red, green, blue if needed."""
    is_coloured = any(part.vertex_rgb is not None for part in parts)
    rows = []
    for part in parts:
        corners = (part.vertices_m - centre_m)[part.faces]
        values = [np.zeros((len(part.vertices_m), 2)) if part.uv is None else part.uv]
        if is_coloured:
            white = np.full((len(part.vertices_m), 3), 255, np.uint8)
            values.append((white if part.vertex_rgb is None else part.vertex_rgb) / 255.0)
        rows.append(_linear(corners, np.hstack(values)[part.faces]))
    return np.concatenate(rows)


def _linear(corners: Floats, values: Floats) -> Floats:
    """Rows (F, 1 + K, 4): the plane of each triangle, then what is linear between ``values``.

    Args:
        corners: (F, 3, 3) positions of the three corners.
        values: (F, 3, K) values at the three corners.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    squared = np.sum(normal**2, axis=1)
    squared[squared == 0.0] = 1.0  # a triangle without area is never hit
    # Gradients of the barycentric coordinates of the second and third corner.
    barycentric = np.stack([np.cross(second, normal), np.cross(normal, first)], axis=1)
    barycentric /= squared[:, None, None]
    steps = values[:, 1:] - values[:, :1]  # (F, 2, K)
    gradient = np.einsum("fbk,fbj->fkj", steps, barycentric)
    gradient = np.concatenate([(normal / np.sqrt(squared)[:, None])[:, None], gradient], axis=1)
    at_corner = np.concatenate([np.zeros((len(values), 1)), values[:, 0]], axis=1)
    constant = at_corner - np.einsum("fkj,fj->fk", gradient, corners[:, 0])
    return np.concatenate([gradient, constant[:, :, None]], axis=2)
