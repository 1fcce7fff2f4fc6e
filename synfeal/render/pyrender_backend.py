"""Rendering with pyrender on EGL: a GPU where there is one, Mesa's software renderer elsewhere.

Images are unlit, since the light of a reconstruction is in its texture; surfaces show from both
sides; textures are mip-mapped and a pixel is the mean of a grid of samples, so that small images do
not alias. Depth is exact at the pixel's centre.

pyrender 0.1.45, its last release, is used as it is installed, but by one subclass of its renderer,
:class:`_Pass`, with our shaders and buffers. What that is for, it offers no setting for:

- Multi-sampling cannot be switched off (https://github.com/mmatl/pyrender/issues/101). It takes
  depth from one of the samples, up to half a pixel from the centre, and in 24 bits that are spent
  near the camera. Depth is also read when only colours are asked for.
- What a texture cuts out still covers what is behind it
  (https://github.com/mmatl/pyrender/pull/242), and unlit renders do not test alpha at all.
- Indices of triangles cannot be drawn.
- A renderer frees the meshes of other scenes than the one it draws, and a second one needs a
  context of its own, whose end is the end of the first
  (https://github.com/mmatl/pyrender/issues/223). Here scenes and passes share one context.

Its viewer is left out where nobody has loaded it before: it is built on pyglet, which needs X's
libraries, and does not load on machines without them.

With NumPy 2 pyrender cannot compute the extent of a scene
(https://github.com/mmatl/pyrender/issues/288). Nothing here asks for it: the far plane is given,
and there are no shadows.
"""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render.base import (
    DEFAULTS,
    SHADERS,
    Depth,
    Faces,
    Renderer,
    Rgb,
    UnavailableError,
    drawn_pieces,
    faces_of_halves,
    floor_share,
    thresholded,
)


@contextmanager
def _without_viewer() -> Iterator[None]:
    """Let pyrender be loaded without the module of its viewer, unless that is loaded already."""
    name = "pyrender.viewer"
    if name in sys.modules:
        yield
        return
    left_out = ModuleType(name, "Left out by synfeal.render.pyrender_backend.")
    left_out.Viewer = None  # type: ignore[attr-defined]
    sys.modules[name] = left_out
    try:
        yield
    finally:
        del sys.modules[name]


# Read by PyOpenGL when it is loaded, and the way pyrender is told how to draw without a display
# (https://pyrender.readthedocs.io/en/latest/examples/offscreen.html).
os.environ["PYOPENGL_PLATFORM"] = "egl"
try:
    with _without_viewer():
        import pyrender
    from OpenGL import GL
    from pyrender.constants import GLTF
    from pyrender.platforms import egl
    from pyrender.shader_program import ShaderProgramCache
except AttributeError as error:  # of PyOpenGL, where a library lacks functions that it looks up
    raise ImportError(f"PyOpenGL cannot be loaded ({error})") from error

# OpenGL cameras are x right, y up, z backward; ours are x right, y down, z forward.
CAM_FROM_GL: NDArray[np.float64] = np.diag([1.0, -1.0, -1.0, 1.0])
# Half a level sharper than the nearest one: samples are averaged, so that textures may alias a
# little. Depth asks whether the very texel at the pixel's centre is cut out.
COLOR_BIAS, DEPTH_BIAS = -0.5, -100.0


@functools.cache
def _context() -> tuple[Any, _Pass, _Pass, _Pass]:
    """Create this process's one OpenGL context, with passes for colour, depth and triangles.

    Deleting one terminates the EGL display all others share, so it is made once and kept
    (https://github.com/mmatl/pyrender/issues/223).

    Raises:
        UnavailableError: EGL has no such device, or gives no context.
    """
    try:
        device = egl.get_device_by_index(int(os.environ.get("EGL_DEVICE_ID", "0")))
        platform = egl.EGLPlatform(16, 16, device)
        platform.init_context()
    except (AssertionError, RuntimeError, ValueError) as error:  # as pyrender says it
        raise UnavailableError(str(error) or "EGL gives no context") from error
    # Texture rows are packed; by default OpenGL expects each to start at a multiple of 4 bytes,
    # which shears textures of odd width (https://github.com/mmatl/pyrender/issues/265).
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
    uploaded: set[Any] = set()
    rgb, depth = (GL.GL_RGB, GL.GL_UNSIGNED_BYTE), (GL.GL_RED, GL.GL_FLOAT)
    halves = (GL.GL_RGB, GL.GL_FLOAT)  # two channels, which the bindings cannot read alone
    return (
        platform,
        _Pass(uploaded, 0, COLOR_BIAS, GL.GL_RGBA8, rgb, np.uint8),
        _Pass(uploaded, 1, DEPTH_BIAS, GL.GL_R32F, depth, np.float32),
        _Pass(uploaded, 2, DEPTH_BIAS, GL.GL_RG32F, halves, np.float32),
    )


class PyrenderRenderer(Renderer):
    """Implements :class:`synfeal.render.base.Renderer`; several may live in one process."""

    def __init__(
        self, mesh: TexturedMesh, camera: CameraConfig, render: RenderConfig = DEFAULTS
    ) -> None:
        """Prepare the mesh, which is uploaded by the first render."""
        self._supersampling = render.supersampling
        self._floor_share = floor_share(render)
        self._platform, self._color, self._depth, self._faces = _context()
        self._size = (camera.width, camera.height)
        self._intrinsics = camera.intrinsics
        self._background = np.array([*render.background_rgb, 0]) / 255.0
        self._scene = pyrender.Scene()
        # Vertex buffers hold single precision: exact around the scene's own centre, wherever it is.
        self._centre_m = mesh.bounds_m.mean(axis=0)
        drawn = list(drawn_pieces(mesh))
        primitives = [_primitive(part, self._centre_m) for part, _ in drawn]
        self._first_face = dict(zip(primitives, (first for _, first in drawn), strict=True))
        self._scene.add(pyrender.Mesh(primitives))
        self._camera = self._scene.add(
            pyrender.IntrinsicsCamera(*self._intrinsics, znear=camera.near_m, zfar=camera.far_m)
        )

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Render colours (H, W, 3) from a pose ``world_from_cam`` (4, 4)."""
        self._look_from(world_from_cam)
        samples = self._drawn(self._color, self._supersampling, self._background)
        return mean_of_samples(samples, self._supersampling)

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Render colours (H, W, 3) and depth (H, W), metres along the optical axis or inf."""
        return self.render(world_from_cam), self.render_depth(world_from_cam)

    def render_depth(self, world_from_cam: NDArray[np.float64]) -> Depth:
        """Render depth (H, W) alone: metres along the optical axis, inf for nothing."""
        self._look_from(world_from_cam)
        depth_m = self._drawn(self._depth, 1, np.zeros(4))[..., 0]
        return np.where(depth_m > 0.0, depth_m, np.float32(np.inf))

    def render_faces(self, world_from_cam: NDArray[np.float64]) -> Faces:
        """Return the index (H, W) of the triangle at the centre of each pixel, -1 for nothing."""
        self._look_from(world_from_cam)
        self._faces.first_face = self._first_face
        return faces_of_halves(self._drawn(self._faces, 1, np.zeros(4))[..., :2])

    def _look_from(self, world_from_cam: NDArray[np.float64]) -> None:
        centred = np.array(world_from_cam, np.float64)
        centred[:3, 3] -= self._centre_m
        self._scene.set_pose(self._camera, centred @ CAM_FROM_GL)

    def _drawn(self, one_pass: _Pass, factor: int, background: NDArray[np.float64]) -> Any:
        """Draw a pass of the scene, ``factor`` times as large as the image (H, W, C)."""
        self._scene.bg_color = background
        self._platform.make_current()
        one_pass.viewport_width, one_pass.viewport_height = (factor * n for n in self._size)
        one_pass.floor_share = self._floor_share
        for name, value in zip(("fx", "fy", "cx", "cy"), self._intrinsics, strict=True):
            setattr(self._camera.camera, name, factor * value)
        flags = pyrender.RenderFlags
        return one_pass.render(self._scene, flags.FLAT | flags.SKIP_CULL_FACES | flags.OFFSCREEN)

    def close(self) -> None:
        """Free the scene's buffers and textures."""
        self._platform.make_current()
        self._color.forget(self._scene)
        self._scene.clear()


def mean_of_samples(samples: NDArray[np.uint8], factor: int) -> Rgb:
    """Average ``factor`` x ``factor`` samples to each pixel of an image (H, W, 3)."""
    total = np.zeros((samples.shape[0] // factor, samples.shape[1] // factor, 3), np.uint16)
    for row in range(factor):
        for column in range(factor):
            total += samples[row::factor, column::factor]
    return ((total + factor**2 // 2) // factor**2).astype(np.uint8)


def _primitive(part: MeshPart, centre_m: NDArray[np.float64]) -> Any:
    """Build one part around ``centre_m``; the alpha test is already decided in its texture."""
    rgba = texture = None
    if part.vertex_rgb is not None:
        rgb = part.vertex_rgb.astype(np.float32) / 255.0
        rgba = np.pad(rgb, ((0, 0), (0, 1)), constant_values=1)
    if part.texture is not None:
        pixels = thresholded(part)
        channels = "RGBA" if pixels.shape[2] == 4 else "RGB"
        # Trilinear filtering costs a fifth more and is no closer to the mean of many samples.
        wrap_s, wrap_t = (GLTF.CLAMP_TO_EDGE if c else GLTF.REPEAT for c in part.clamped_uv)
        sampler = pyrender.Sampler(minFilter=GLTF.LINEAR_MIPMAP_NEAREST, wrapS=wrap_s, wrapT=wrap_t)
        texture = pyrender.Texture(sampler=sampler, source=pixels, source_channels=channels)
    material = pyrender.MetallicRoughnessMaterial(
        baseColorTexture=texture,
        baseColorFactor=np.append(part.base_color[:3] / 255.0, 1.0),
        doubleSided=True,
    )
    return pyrender.Primitive(
        positions=(part.vertices_m - centre_m).astype(np.float32),
        indices=part.faces.astype(np.uint32),
        texcoord_0=None if part.uv is None else part.uv.astype(np.float32),
        color_0=rgba,
        material=material,
    )


class _Pass(pyrender.Renderer):  # type: ignore[misc]  # pyrender is untyped
    """Draws scenes with our shaders into a floating-point or byte buffer.

    Overrides what pyrender has no setting for; the docstring of the module says what and why.
    """

    def __init__(
        self,
        uploaded: set[Any],
        output: int,
        level_bias: float,
        storage: Any,
        read_as: tuple[Any, Any],
        dtype: type,
    ) -> None:
        """Make the framebuffer that the pass draws into.

        Args:
            uploaded: Meshes that are in the context, shared by all passes.
            output: Number of the shader's output that is drawn.
            level_bias: Added to the mip level of textures.
            storage: OpenGL's format of what is drawn.
            read_as: OpenGL's channels, and their type, in which it is read.
            dtype: NumPy's type of the same.
        """
        super().__init__(16, 16)
        self._program_cache = ShaderProgramCache(str(SHADERS))
        self._uploaded, self._level_bias = uploaded, level_bias
        self.floor_share = 1.0
        self._formats = (storage, GL.GL_DEPTH_COMPONENT32F)
        self._read_as, self._dtype = read_as, dtype
        self.first_face: Mapping[Any, int] = {}  # index of the first triangle, by primitive
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
        program.set_uniform("floor_share", self.floor_share)
        program.set_uniform("first_face", self.first_face.get(primitive, 0))
        super()._bind_and_draw_primitive(primitive, pose, program, flags)

    def _read_main_framebuffer(self, scene: Any, flags: int) -> NDArray[Any]:
        """Read the image that was drawn (H, W, C)."""
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._main_fb_ms)
        content = GL.glReadPixels(0, 0, *self._main_fb_dims, *self._read_as)
        pixels: NDArray[Any] = np.frombuffer(content, self._dtype)
        return pixels.reshape(*self._main_fb_dims[::-1], -1)[::-1]  # OpenGL begins at the bottom


def _primitives(meshes: set[Any]) -> list[Any]:
    return [primitive for mesh in meshes for primitive in mesh.primitives]
