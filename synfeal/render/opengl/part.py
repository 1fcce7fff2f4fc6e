"""One part of a mesh on the device: vertices, triangles in chunks, texture, and how it is drawn."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.mesh.model import MeshPart
from synfeal.render.opengl import shaders
from synfeal.render.opengl.chunks import chunks_of, visible_runs
from synfeal.render.pieces import thresholded

# Textures are read from the mip level nearest to what the samples ask for, half a level sharper.
# Trilinear filtering takes a sixth longer for a mean error 4 % smaller; without the shift the error
# is a fifth larger (blur), with a whole level fine checkerboards alias.
LEVEL_BIAS = -0.5
FILTER = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)


class DevicePart:
    """A part's buffers, with one way to draw its colours and one its depth."""

    def __init__(self, context: Any, part: MeshPart, centre_m: NDArray[np.float64]) -> None:
        self._context = context
        vertices_m = part.vertices_m - centre_m
        self._chunks = chunks_of(vertices_m, part.faces)
        used = self._chunks.vertices
        self._buffers = [context.buffer(self._chunks.faces.astype(np.uint32))]
        is_textured = part.texture is not None and part.uv is not None
        pixels = thresholded(part) if is_textured else None
        self._texture = None if pixels is None else _upload(context, pixels)
        position = self._attribute(vertices_m[used].astype(np.float32), "3f", "position")
        uv, rgb = [], []
        if part.uv is not None and is_textured:
            uv = [self._attribute(part.uv[used].astype(np.float32), "2f", "corner_uv")]
        if part.vertex_rgb is not None:
            rgba = np.pad(part.vertex_rgb[used], ((0, 0), (0, 1)))  # rows of 4 bytes
            rgb = [self._attribute(rgba, "3f1 1x1", "corner_rgb")]
        features = ["TEXTURED"] * bool(uv) + ["COLOURED"] * bool(rgb)
        if pixels is not None and pixels.shape[2] == 4:
            features.append("CUT_OUT")
        self.colour = self._program(shaders.COLOUR, features, [position, *uv, *rgb])
        self.colour.program["base_rgb"].value = tuple(part.base_color[:3] / 255.0)
        if uv:
            self.colour.program["level_bias"].value = LEVEL_BIAS
        cut_out = ["TEXTURED", "CUT_OUT"] if "CUT_OUT" in features else []
        self.depth = self._program(shaders.DEPTH, cut_out, [position, *(uv if cut_out else [])])

    def _attribute(self, values: NDArray[Any], layout: str, name: str) -> tuple[Any, str, str]:
        self._buffers.append(self._context.buffer(np.ascontiguousarray(values)))
        return self._buffers[-1], layout, name

    def _program(self, fragment: str, features: list[str], attributes: list[Any]) -> Any:
        """A vertex array that draws the part's triangles with a program of its own."""
        program = self._context.program(
            vertex_shader=shaders.with_features(shaders.VERTEX, features),
            fragment_shader=shaders.with_features(fragment, features),
        )
        return self._context.vertex_array(program, attributes, self._buffers[0])

    def draw(self, triangles: Any, clip_from_mesh: NDArray[np.float64]) -> None:
        """Draw ``colour``, or as ``depth`` distances along the optical axis in metres.

        Into the framebuffer in use.
        """
        by_columns = clip_from_mesh.astype(np.float32).tobytes(order="F")
        triangles.program["clip_from_mesh"].write(by_columns)
        if self._texture is not None:
            self._texture.use(0)
        for first, count in visible_runs(self._chunks, clip_from_mesh):
            triangles.render(moderngl.TRIANGLES, vertices=count, first=first)

    def release(self) -> None:
        """Free what lies on the device."""
        for triangles in (self.colour, self.depth):
            triangles.program.release()
            triangles.release()
        for buffer in self._buffers:
            buffer.release()
        if self._texture is not None:
            self._texture.release()


def _upload(context: Any, pixels: NDArray[np.uint8]) -> Any:
    """A mip-mapped texture of pixels (H, W, C), first row at the top, as large as is possible."""
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
