"""One part of a mesh on the device: triangles in chunks that a camera may see, texture, shaders.

Chunks keep one order whatever is visible, so that culling never decides which of two coincident
surfaces shows. Front-to-back order was measured too and gains nothing on llvmpipe.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.mesh.model import MeshPart
from synfeal.render.base import SHADERS, thresholded

Floats = NDArray[np.float64]
# 64 to 512 cost the same; with one sample per pixel culling takes a tenth off a frame at 640x480,
# a third at 128x96.
FACES_PER_CHUNK = 128
BITS_PER_AXIS = 10
MARGIN = 1e-4  # share of the part's size: far more than single precision on the device moves

# Textures are read from the mip level nearest to what the samples ask for, half a level sharper.
# Trilinear filtering takes a sixth longer for a mean error 4 % smaller; without the shift the error
# is a fifth larger (blur), with a whole level fine checkerboards alias.
LEVEL_BIAS = -0.5
FILTER = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)


class Chunks(NamedTuple):
    """Spatially sorted faces and the boxes around each run of ``FACES_PER_CHUNK`` of them."""

    vertices: NDArray[np.int64]  # (V,) which vertices are used, in the order of their first use
    faces: NDArray[np.int64]  # (F, 3) indices into ``vertices``
    order: NDArray[np.int64]  # (F,) where each face stood before they were sorted
    lower_m: Floats  # (C, 3) lower corners of the boxes
    upper_m: Floats  # (C, 3) upper corners


def chunks_of(vertices_m: Floats, faces: NDArray[np.int64]) -> Chunks:
    """Sort faces (F, 3) along a space-filling curve and box them."""
    order = np.argsort(_morton_codes(vertices_m[faces].mean(axis=1)), kind="stable")
    faces = faces[order]
    used, first, inverse = np.unique(faces, return_index=True, return_inverse=True)
    by_first_use = np.argsort(first)
    rank = np.empty_like(by_first_use)
    rank[by_first_use] = np.arange(len(used))
    starts = np.arange(0, len(faces), FACES_PER_CHUNK)
    corners = vertices_m[faces]
    margin = MARGIN * np.ptp(vertices_m[used], axis=0).max()
    return Chunks(
        vertices=used[by_first_use],
        faces=rank[inverse.reshape(-1, 3)],
        order=order,
        lower_m=np.minimum.reduceat(corners.min(axis=1), starts) - margin,
        upper_m=np.maximum.reduceat(corners.max(axis=1), starts) + margin,
    )


def _morton_codes(points_m: Floats) -> NDArray[np.int64]:
    """Return the place of each point (N, 3) on a Z-order curve through their bounding cube."""
    lower = points_m.min(axis=0)
    side = max(float(np.ptp(points_m, axis=0).max()), np.finfo(np.float64).tiny)
    cells = 1 << BITS_PER_AXIS
    cell = np.minimum((points_m - lower) / side * cells, cells - 1).astype(np.int64)
    codes = np.zeros(len(points_m), np.int64)
    for bit in range(BITS_PER_AXIS):
        for axis in range(3):
            codes |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    return codes


def visible_runs(chunks: Chunks, clip_from_mesh: Floats) -> list[tuple[int, int]]:
    """Find runs of chunks that may be in the frustum: first index and number of indices of each.

    ``clip_from_mesh`` (4, 4) maps to OpenGL's clip coordinates: -w <= x, y, z <= w is drawn.
    """
    seen = np.ones(len(chunks.lower_m), bool)
    for axis in range(3):
        for sign in (1.0, -1.0):
            plane = clip_from_mesh[3] + sign * clip_from_mesh[axis]  # inside where >= 0
            innermost = np.where(plane[:3] > 0.0, chunks.upper_m, chunks.lower_m)
            seen &= innermost @ plane[:3] + plane[3] >= 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], seen, [False]]).astype(np.int8)))
    stops = np.minimum(edges[1::2] * FACES_PER_CHUNK, len(chunks.faces))
    starts = edges[::2] * FACES_PER_CHUNK
    return [(3 * int(a), 3 * int(b - a)) for a, b in zip(starts, stops, strict=True)]


def program_of(context: Any, vertex: str, fragment: str, features: Collection[str] = ()) -> Any:
    """Compile a program of two files in ``shaders``, with the named features defined."""
    header = "#version 330\n" + "".join(f"#define {name}\n" for name in sorted(features))
    vertex, fragment = (header + (SHADERS / name).read_text() for name in (vertex, fragment))
    return context.program(vertex_shader=vertex, fragment_shader=fragment)


class DevicePart:
    """A part's buffers, with one way each to draw its colours, depth and numbers of triangles."""

    def __init__(
        self,
        context: Any,
        part: MeshPart,
        centre_m: NDArray[np.float64],
        floor_share: float = 1.0,
    ) -> None:
        """Upload a part.

        Args:
            context: moderngl's context, which is current.
            part: World frame.
            centre_m: Origin (3,) of the coordinates on the device, world, metres.
            floor_share: See :func:`synfeal.render.base.floor_share`.
        """
        self._context = context
        vertices_m = part.vertices_m - centre_m
        self._chunks = chunks_of(vertices_m, part.faces)
        used = self._chunks.vertices
        self._index = context.buffer(self._chunks.faces.astype(np.uint32))
        is_textured = part.texture is not None and part.uv is not None
        pixels = thresholded(part) if is_textured else None
        self._texture = None
        if pixels is not None:
            self._texture = _upload(context, pixels)
            self._texture.repeat_x, self._texture.repeat_y = (not c for c in part.clamped_uv)
        position = self._attribute(vertices_m[used].astype(np.float32), "3f", "position")
        uv, rgb = [], []
        if part.uv is not None and is_textured:
            uv = [self._attribute(part.uv[used].astype(np.float32), "2f", "corner_uv")]
        if part.vertex_rgb is not None:
            rgba = np.pad(part.vertex_rgb[used], ((0, 0), (0, 1)))  # rows of 4 bytes
            rgb = [self._attribute(rgba, "3f1 1x1", "corner_rgb")]
        features = ["TEXTURED"] * bool(uv) + ["COLORED"] * bool(rgb)
        if pixels is not None and pixels.shape[2] == 4:
            features.append("CUT_OUT")
        self._has_headlight = floor_share < 1.0
        lit = [*features, "HEADLIGHT"] if self._has_headlight else features
        self.color = self._program("color.frag", lit, [position, *uv, *rgb])
        if self._has_headlight:
            self.color.program["floor_share"].value = floor_share
        self.color.program["base_rgb"].value = tuple(part.base_color[:3] / 255.0)
        if uv:
            self.color.program["level_bias"].value = LEVEL_BIAS
        self._cut_out = ["TEXTURED", "CUT_OUT"] if "CUT_OUT" in features else []
        self._solid = [position, *(uv if self._cut_out else [])]
        self.depth = self._program("depth.frag", self._cut_out, self._solid)

    @property
    def order(self) -> NDArray[np.int64]:
        """Index in the part (F,) of each triangle, in the order in which they are numbered."""
        return self._chunks.order

    @cached_property
    def faces(self) -> Any:
        """Vertex array that draws the index of each triangle, compiled on first use."""
        return self._program("faces.frag", self._cut_out, self._solid)

    def _attribute(self, values: NDArray[Any], layout: str, name: str) -> tuple[Any, str, str]:
        return self._context.buffer(np.ascontiguousarray(values)), layout, name

    def _program(self, fragment: str, features: list[str], attributes: list[Any]) -> Any:
        """Make a vertex array that draws the part's triangles with a program of its own."""
        program = program_of(self._context, "part.vert", fragment, features)
        return self._context.vertex_array(program, attributes, self._index)

    def light_from(self, camera_m: Floats) -> None:
        """Put the headlight, if there is one, at a camera (3,), relative to the centre."""
        if self._has_headlight:
            self.color.program["camera"].value = tuple(camera_m.tolist())

    def draw(
        self,
        triangles: Any,
        clip_from_mesh: NDArray[np.float64],
        culled_from_mesh: NDArray[np.float64],
        first_face: int | None = None,
    ) -> None:
        """Draw into the framebuffer in use.

        Args:
            triangles: ``color``, ``depth`` along the optical axis, or ``faces``.
            clip_from_mesh: Projection (4, 4).
            culled_from_mesh: The same of the part of the image that is drawn: chunks outside of its
                frustum are left out.
            first_face: With ``faces``, the number of the part's first triangle.
        """
        by_columns = clip_from_mesh.astype(np.float32).tobytes(order="F")
        triangles.program["clip_from_mesh"].write(by_columns)
        if self._texture is not None:
            self._texture.use(0)
        for first, count in visible_runs(self._chunks, culled_from_mesh):
            if first_face is not None:  # OpenGL counts from the beginning of each run
                triangles.program["first_face"].value = first_face + first // 3
            triangles.render(moderngl.TRIANGLES, vertices=count, first=first)


def _upload(context: Any, pixels: NDArray[np.uint8]) -> Any:
    """Upload pixels (H, W, C), top row first, as a mip-mapped texture, shrunk if too large."""
    limit = context.info["GL_MAX_TEXTURE_SIZE"]
    if max(pixels.shape[:2]) > limit:
        pixels = np.asarray(Image.fromarray(pixels).reduce(-(-max(pixels.shape[:2]) // limit)))
    height, width, channels = pixels.shape
    rows = np.full((height, width, 4), 255, np.uint8)  # Mesa reads rows of 3 bytes 8 % slower
    rows[..., :channels] = pixels[::-1]  # OpenGL begins at the bottom
    texture = context.texture((width, height), 4, rows)
    texture.build_mipmaps()
    texture.filter = FILTER
    return texture
