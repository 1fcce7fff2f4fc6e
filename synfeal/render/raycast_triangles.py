"""Triangles that rays can hit, with the colour of every point on them.

What varies over a triangle (distance from its plane, texture coordinates, vertex colours) is linear
in space. Each is kept as one row of a matrix per triangle, which times a point in homogeneous
coordinates gives the value there. Along a ray the rows give a constant and a slope; the plane is
met where its own vanishes, and all else follows, derivatives from pixel to pixel included.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.render.base import thresholded

Floats = NDArray[np.float64]
Rgba = NDArray[np.float32]
Faces = NDArray[np.int64]

# A ray goes on this much, of the mesh's extent, behind what it passes: twice what the ray caster
# may be wrong by.
STEP = 2e-6
EDGE_ON = 1e-3
LEAST_ALPHA = 127.5  # of 255: what is left of cut-out textures after filtering
MOST_LAYERS = 64  # that a ray passes before it counts as lost


class Viewpoint(NamedTuple):
    """Viewpoint and pixel size of a look at triangles, in their frame."""

    origin_m: Floats  # (3,) position of the camera
    per_px: Floats  # (2, 3) how rays change from pixel to pixel along x and y
    near_m: float  # least depth
    far_m: float  # greatest depth


class Points(NamedTuple):
    """Points on triangles."""

    rays: Floats  # (N, 3) through which they are seen
    face: Faces  # (N,) index of the triangle
    depth_m: Floats  # (N,) along the optical axis
    values: Floats  # (N, 2 | 5) texture coordinates and, if any part has them, colours, 0 to 1


class TexturedTriangles:
    """All drawn parts of a mesh; coordinates are relative to ``centre_m``."""

    def __init__(self, mesh: TexturedMesh) -> None:
        parts = [part for part in mesh.parts if part.is_drawn]
        vertices, faces = TexturedMesh(tuple(parts)).merged()
        self.centre_m: Floats = mesh.bounds_m.mean(axis=0)
        self._step_m = STEP * float(np.ptp(mesh.bounds_m, axis=0).max())
        self._caster = RayCaster(vertices - self.centre_m, faces)
        self._rows = _rows(parts, self.centre_m)
        self._part_of = np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts])
        drawn = np.concatenate([np.full(len(p.faces), p.is_drawn) for p in mesh.parts])
        # Index in the mesh of each triangle, and of nothing, the last.
        self.face_of_mesh = np.append(np.flatnonzero(drawn), -1).astype(np.int32)
        self._tint = np.array([part.base_color[:3] / 255.0 for part in parts])
        textures, clamped_uv, self._texture_of = _textures(parts)
        self._has_cutouts = np.array([a.shape[2] == 4 for a in textures])[self._texture_of]
        self._textures = MipMaps(textures, clamped_uv)

    def first_drawn(self, view: Viewpoint, rays: Floats) -> tuple[Faces, Floats]:
        """Find the first triangle (N,) that shows on each ray, -1 for none, and its depth (N,).

        ``rays`` (N, 3) are of unit length along the optical axis.
        """
        face, depth_m = self._first_hits(view, rays, np.full(len(rays), view.near_m))
        pending = np.flatnonzero(self._is_cut_out(face))
        for _ in range(MOST_LAYERS):
            if not len(pending):
                break
            points = self.points(view, rays[pending], face[pending], depth_m[pending])
            alpha = self._texel(view, points)[:, 3]
            pending = pending[alpha < LEAST_ALPHA]
            start_m = depth_m[pending] + self._step_m
            face[pending], depth_m[pending] = self._first_hits(view, rays[pending], start_m)
            pending = pending[self._is_cut_out(face[pending])]
        face[pending] = -1
        face[depth_m > view.far_m] = -1
        return face, depth_m

    def points(self, view: Viewpoint, rays: Floats, face: Faces, depth_m: Floats) -> Points:
        """Intersect rays with the planes of triangles they are known to hit, in double precision.

        Args:
            view: Origin of the rays.
            rays: Rays (N, 3), of unit length along the optical axis.
            face: Triangle (N,) that each ray hits.
            depth_m: Depth (N,) of the hit, metres, as the ray caster found it. The exact one stays
                near it where a triangle is seen edge-on.

        Returns:
            The hits with exact depth, texture coordinates and vertex colours.
        """
        rows = self._rows[face]
        constant = np.einsum("nkj,j->nk", rows, np.append(view.origin_m, 1.0))
        slope = np.einsum("nkj,nj->nk", rows[:, :, :3], rays)
        with np.errstate(divide="ignore", invalid="ignore"):
            exact_m = -constant[:, 0] / slope[:, 0]
        # A triangle seen edge-on has a plane that is met anywhere, or nowhere.
        depth_m = np.fmax(np.fmin(exact_m, (1.0 + EDGE_ON) * depth_m), (1.0 - EDGE_ON) * depth_m)
        values = constant[:, 1:] + depth_m[:, None] * slope[:, 1:]
        return Points(rays, face, depth_m, values)

    def _uv_per_px(self, view: Viewpoint, points: Points) -> Floats:
        """Return derivatives (N, 4) of u and v along x and y: du/dx, dv/dx, du/dy, dv/dy."""
        gradient, depth_m = self._rows[points.face, :3, :3], points.depth_m
        slope = np.einsum("nkj,nj->nk", gradient, points.rays)
        slope[slope[:, 0] == 0.0, 0] = np.inf
        changes = []
        for step in view.per_px:
            turn = np.einsum("nkj,j->nk", gradient, step)
            away = -depth_m * turn[:, 0] / slope[:, 0]
            changes += [away * slope[:, k] + depth_m * turn[:, k] for k in (1, 2)]
        return np.stack(changes, axis=1)

    def rgb(self, view: Viewpoint, points: Points) -> Rgba:
        """Look up colours (N, 3), 0 to 255."""
        tint = self._tint[self._part_of[points.face]]
        if points.values.shape[1] == 5:
            tint = tint * np.clip(points.values[:, 2:], 0.0, 1.0)
        return self._texel(view, points)[:, :3] * tint.astype(np.float32)

    def view_cosines(self, points: Points) -> Floats:
        """Return cosines (N,), 0 to 1, between lines of sight and the normals of triangles."""
        normals = self._rows[points.face, 0, :3]
        along = np.einsum("nj,nj->n", normals, points.rays)
        return np.asarray(np.abs(along) / np.linalg.norm(points.rays, axis=1))

    def _texel(self, view: Viewpoint, points: Points) -> Rgba:
        uv, uv_per_px = points.values[:, :2], self._uv_per_px(view, points)
        return self._textures.rgba(self._texture_of[self._part_of[points.face]], uv, uv_per_px)

    def _is_cut_out(self, face: Faces) -> NDArray[np.bool_]:
        """Mark rays that hit a face whose texture has a hole there."""
        return np.asarray((face >= 0) & self._has_cutouts[self._part_of[face]], np.bool_)

    def _first_hits(self, view: Viewpoint, rays: Floats, start_m: Floats) -> tuple[Faces, Floats]:
        """Find the first triangles at depths beyond ``start_m`` (N,), and their depths."""
        origins = view.origin_m + start_m[:, None] * rays
        distance_m, face = self._caster.first_hits(origins, rays)
        return face, start_m + distance_m / np.linalg.norm(rays, axis=1)


def _textures(
    parts: list[MeshPart],
) -> tuple[list[NDArray[np.uint8]], list[tuple[bool, bool]], NDArray[np.intp]]:
    """List distinct textures, white for parts without one.

    Returns:
        The textures, whether each is clamped along u and v, and the texture of each part.
    """
    keys = [
        part.texture is not None
        and (id(part.texture), part.alpha_cutoff, part.base_color[3], part.clamped_uv)
        for part in parts
    ]
    shown = dict(zip(keys, parts, strict=True))
    order, white = list(shown), np.full((1, 1, 3), 255, np.uint8)
    textures = [white if part.texture is None else thresholded(part) for part in shown.values()]
    clamped_uv = [part.clamped_uv for part in shown.values()]
    return textures, clamped_uv, np.array([order.index(key) for key in keys])


def _rows(parts: list[MeshPart], centre_m: Floats) -> Floats:
    """Tabulate per triangle (F, 3 | 6, 4) plane distance, u, v, and red, green, blue if needed."""
    is_colored = any(part.vertex_rgb is not None for part in parts)
    rows = []
    for part in parts:
        corners = (part.vertices_m - centre_m)[part.faces]
        values = [np.zeros((len(part.vertices_m), 2)) if part.uv is None else part.uv]
        if is_colored:
            rgb = part.vertex_rgb
            values.append(np.ones((len(part.vertices_m), 3)) if rgb is None else rgb / 255.0)
        rows.append(_linear(corners, np.hstack(values)[part.faces]))
    return np.concatenate(rows)


def _linear(corners: Floats, values: Floats) -> Floats:
    """Compute rows (F, 1 + K, 4): each triangle's plane, then values linear between the corners.

    ``corners`` (F, 3, 3) are the positions, ``values`` (F, 3, K) the values at the three corners.
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


class MipMaps:
    """Several textures with all their mip levels in one buffer, so that one look-up serves all.

    Looked up as OpenGL does it: repeated or clamped to the edge, and bilinear in the mip level just
    sharp enough.
    """

    def __init__(
        self,
        textures: Sequence[NDArray[np.uint8]],
        clamped_uv: Sequence[tuple[bool, bool]] | None = None,
    ) -> None:
        """Halve each texture down to one texel.

        Args:
            textures: Pixels (H, W, 3 | 4), first row at the top.
            clamped_uv: Whether each is clamped along u and v; all repeat if None.
        """
        self._is_clamped = np.array(clamped_uv or [(False, False)] * len(textures))
        sizes = [_sizes(texture.shape[1], texture.shape[0]) for texture in textures]
        self._top_level = np.array([len(chain) - 1 for chain in sizes])
        # Width and height, and where the level starts, by texture and level.
        self._size = np.ones((len(sizes), max(map(len, sizes)), 2), np.int64)
        self._start = np.zeros(self._size.shape[:2], np.int64)
        self._texels = np.empty(sum(w * h for chain in sizes for w, h in chain), np.uint32)
        end = 0
        for row, (texture, chain) in enumerate(zip(textures, sizes, strict=True)):
            for column, (size, texels) in enumerate(zip(chain, _levels(texture), strict=True)):
                start, end = end, end + texels.size
                self._size[row, column], self._start[row, column] = size, start
                self._texels[start:end] = texels

    def rgba(self, texture: NDArray[np.intp], uv: Floats, uv_per_px: Floats) -> Rgba:
        """Look up colours.

        Args:
            texture: Index (N,) of the texture of each point.
            uv: Texture coordinates (N, 2), origin at the bottom left.
            uv_per_px: Their change (N, 4) from pixel to pixel: du/dx, dv/dx, du/dy, dv/dy.

        Returns:
            Colours (N, 4), 0 to 255.
        """
        ux, vx, uy, vy = (uv_per_px * np.tile(self._size[texture, 0], 2)).T
        squared = np.maximum(np.maximum(ux**2 + vx**2, uy**2 + vy**2), 1.0)
        level = np.minimum(0.5 * np.log2(squared), self._top_level[texture])
        return self._bilinear(texture, level.astype(np.intp), uv)

    def _bilinear(self, texture: NDArray[np.intp], level: NDArray[np.intp], uv: Floats) -> Rgba:
        width, height = self._size[texture, level].T
        clamp_u, clamp_v = self._is_clamped[texture].T
        left, right, x_share = _neighbours(uv[:, 0], width, clamp_u)
        upper, lower, y_share = _neighbours(1.0 - uv[:, 1], height, clamp_v)
        start = self._start[texture, level]
        upper, lower = start + upper * width, start + lower * width
        corners = (row + column for row in (upper, lower) for column in (left, right))
        packed = (self._texels[corner].view(np.uint8) for corner in corners)
        a, b, c, d = (rgba.reshape(-1, 4).astype(np.float32) for rgba in packed)
        above, below = a + x_share * (b - a), c + x_share * (d - c)
        return np.asarray(above + y_share * (below - above))


def _sizes(width: int, height: int) -> list[tuple[int, int]]:
    """List width and height of each level: halved and rounded down until one texel is left."""
    top = max(width, height).bit_length() - 1
    return [(max(1, width >> level), max(1, height >> level)) for level in range(top + 1)]


def _levels(texture: NDArray[np.uint8]) -> Iterator[NDArray[np.uint32]]:
    """Yield the texels (H * W,) of each level as packed RGBA."""
    height, width, channels = texture.shape
    rgba = np.full((height, width, 4), 255, np.uint8)
    rgba[..., :channels] = texture
    # As RGBX: colours of RGBA images would be weighed by alpha, which OpenGL does not.
    image = Image.frombuffer("RGBX", (width, height), rgba, "raw", "RGBX", 0, 1)
    for size in _sizes(width, height):
        if size != image.size:
            image = image.resize(size, Image.Resampling.BOX)
        yield np.asarray(image).reshape(-1, 4).view(np.uint32)[:, 0]


def _neighbours(
    position: Floats, size: NDArray[np.int64], is_clamped: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Rgba]:
    """Return the texels around a position, and the share (N, 1) of the second."""
    texel = position * size - 0.5
    below = np.floor(texel)
    share = (texel - below).astype(np.float32)[:, None]
    first = below.astype(np.int64)
    second = first + 1
    return _inside(first, size, is_clamped), _inside(second, size, is_clamped), share


def _inside(
    texel: NDArray[np.int64], size: NDArray[np.int64], is_clamped: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return the texel that shows at a place beyond the texture."""
    repeated = texel % size
    if not is_clamped.any():
        return repeated
    return np.where(is_clamped, np.clip(texel, 0, size - 1), repeated)
