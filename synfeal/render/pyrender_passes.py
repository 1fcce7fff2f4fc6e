"""The two passes of the pyrender backend: colours from a grid of samples, depth from pixel centres.

pyrender by itself multi-samples, which takes depth from one of the samples, up to half a pixel from
the centre and in 24 bits that are spent near the camera; it reads depth whether wanted or not; and
it cannot test alpha in unlit renders. Here either pass draws into a buffer of its own, with one
shader for both. Imported only after pyrender was set up, by the backend.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL
from pyrender.renderer import Renderer
from pyrender.shader_program import ShaderProgramCache

SHADERS = Path(__file__).parent / "shaders"
# Half a level sharper than the nearest one: samples are averaged, so that textures may alias a
# little. Depth asks whether the very texel at the pixel's centre is cut out.
COLOUR_BIAS, DEPTH_BIAS = -0.5, -100.0


class _Pass(Renderer):  # type: ignore[misc]  # pyrender is untyped
    """Draws scenes with our shaders into a floating-point or byte buffer.

    Attributes:
        uploaded: the meshes that are in the context, shared by both passes.
    """

    def __init__(self, uploaded: set[Any], storage: Any, output: int, level_bias: float) -> None:
        """Make the buffers.

        Args:
            uploaded: the meshes that are in the context.
            storage: OpenGL's format of what is drawn.
            output: which output of the shader is drawn.
            level_bias: added to the mip level of textures.
        """
        super().__init__(16, 16)
        self._program_cache = ShaderProgramCache(str(SHADERS))
        self._uploaded, self._level_bias = uploaded, level_bias
        self._formats = (storage, GL.GL_DEPTH_COMPONENT32F)
        self._outputs = [GL.GL_NONE] * output + [GL.GL_COLOR_ATTACHMENT0]
        self._main_fb_dims: tuple[Any, Any]
        self._main_fb_ms = GL.glGenFramebuffers(1)
        self._buffers = GL.glGenRenderbuffers(2)

    def _update_context(self, scene: Any, flags: int) -> None:
        """Upload what is new; what other scenes use stays until it is forgotten."""
        for primitive in _primitives(scene.meshes - self._uploaded):
            primitive._add_to_context()
            for texture in primitive.material.textures:
                texture._add_to_context()
        self._uploaded |= scene.meshes

    def forget(self, scene: Any) -> None:
        """Free what was uploaded for a scene."""
        for primitive in _primitives(scene.meshes & self._uploaded):
            primitive.delete()
            for texture in primitive.material.textures:
                texture.delete()
        self._uploaded -= scene.meshes

    def _configure_main_framebuffer(self) -> None:
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._main_fb_ms)
        GL.glDrawBuffers(len(self._outputs), self._outputs)
        size = (self.viewport_width, self.viewport_height)
        if self._main_fb_dims == size:
            return
        self._main_fb_dims = size
        places = (GL.GL_COLOR_ATTACHMENT0, GL.GL_DEPTH_ATTACHMENT)
        for buffer, storage, place in zip(self._buffers, self._formats, places, strict=True):
            GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, buffer)
            GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, storage, *size)
            GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, place, GL.GL_RENDERBUFFER, buffer)

    def _bind_and_draw_primitive(
        self, primitive: Any, pose: NDArray[Any], program: Any, flags: int
    ) -> None:
        program.set_uniform("level_bias", self._level_bias)
        super()._bind_and_draw_primitive(primitive, pose, program, flags)

    def _read(self, channels: Any, kind: Any) -> bytes:
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._main_fb_ms)
        pixels: bytes = GL.glReadPixels(0, 0, *self._main_fb_dims, channels, kind)
        return pixels


class ColourPass(_Pass):
    """Colours (H, W, 3) of a viewport of H x W samples."""

    def __init__(self, uploaded: set[Any]) -> None:
        super().__init__(uploaded, GL.GL_RGBA8, 0, COLOUR_BIAS)

    def _read_main_framebuffer(self, scene: Any, flags: int) -> NDArray[np.uint8]:
        pixels = np.frombuffer(self._read(GL.GL_RGB, GL.GL_UNSIGNED_BYTE), np.uint8)
        return pixels.reshape(*self._main_fb_dims[::-1], 3)[::-1]  # OpenGL begins at the bottom


class DepthPass(_Pass):
    """Depth (H, W) in metres along the optical axis, 0 for nothing."""

    def __init__(self, uploaded: set[Any]) -> None:
        super().__init__(uploaded, GL.GL_R32F, 1, DEPTH_BIAS)

    def _read_main_framebuffer(self, scene: Any, flags: int) -> NDArray[np.float32]:
        pixels = np.frombuffer(self._read(GL.GL_RED, GL.GL_FLOAT), np.float32)
        return pixels.reshape(self._main_fb_dims[::-1])[::-1]


def _primitives(meshes: set[Any]) -> list[Any]:
    return [primitive for mesh in meshes for primitive in mesh.primitives]
