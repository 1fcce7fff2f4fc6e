"""Rendering with pyrender on EGL: a GPU where there is one, Mesa's software renderer elsewhere.

Images are unlit, since the light of a reconstruction is in its texture; surfaces show from both
sides; textures are mip-mapped and a pixel is the mean of a grid of samples, so that small images do
not alias. Depth is exact at the pixel's centre.
"""

from __future__ import annotations

import functools
import os
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig
from synfeal.errors import InputError
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render.base import DEFAULT_SUPERSAMPLING, Depth, Renderer, Rgb
from synfeal.render.pieces import pieces, thresholded

# OpenGL cameras are x right, y up, z backward; ours are x right, y down, z forward.
CAM_FROM_GL: NDArray[np.float64] = np.diag([1.0, -1.0, -1.0, 1.0])


@functools.cache
def _pyrender() -> Any:
    """The pyrender module, set up for EGL and for the installed NumPy."""
    os.environ["PYOPENGL_PLATFORM"] = "egl"
    np.__dict__.setdefault("infty", np.inf)  # gone in NumPy 2, used by pyrender
    import pyrender

    return pyrender


class _Context(NamedTuple):
    """The OpenGL context of this process, and what is drawn in it."""

    platform: Any
    colour: Any
    depth: Any


@functools.cache
def _context() -> _Context:
    """The one context of this process.

    Deleting one terminates the EGL display all others share, so it is made once and kept.

    Raises:
        InputError: there is no EGL, or it offers no device.
    """
    try:
        _pyrender()
        from pyrender.platforms import egl

        device = egl.get_device_by_index(int(os.environ.get("EGL_DEVICE_ID", "0")))
        platform = egl.EGLPlatform(16, 16, device)
        platform.init_context()
        from OpenGL import GL

        from synfeal.render.pyrender_passes import ColourPass, DepthPass

        # Texture rows are packed; by default OpenGL expects each to start at a multiple of 4 bytes,
        # which shears textures of odd width.
        GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)

        uploaded: set[Any] = set()
        return _Context(platform, ColourPass(uploaded), DepthPass(uploaded))
    except Exception as error:  # what is missing decides what is raised
        raise InputError(
            f"rendering needs EGL, which does not work here ({type(error).__name__}: {error});"
            " on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri"
        ) from error


class PyrenderRenderer(Renderer):
    """Implements :class:`synfeal.render.base.Renderer`; several may live in one process."""

    def __init__(
        self,
        mesh: TexturedMesh,
        camera: CameraConfig,
        supersampling: int = DEFAULT_SUPERSAMPLING,
        background_rgb: tuple[int, int, int] = (0, 0, 0),
    ) -> None:
        """Prepare the mesh, which is uploaded by the first render."""
        self._supersampling = supersampling
        self._context = _context()
        pyrender = _pyrender()
        flags = pyrender.RenderFlags
        self._flags = flags.FLAT | flags.SKIP_CULL_FACES | flags.OFFSCREEN
        self._size = (camera.width, camera.height)
        self._intrinsics = camera.intrinsics
        self._background = np.array([*background_rgb, 0]) / 255.0
        self._scene = pyrender.Scene()
        # Vertex buffers hold single precision: exact around the scene's own centre, wherever it is.
        self._centre_m = mesh.bounds_m.mean(axis=0)
        parts = [piece for part in mesh.parts if part.is_drawn for piece in pieces(part)]
        self._scene.add(pyrender.Mesh([_primitive(part, self._centre_m) for part in parts]))
        self._camera = self._scene.add(
            pyrender.IntrinsicsCamera(*self._intrinsics, znear=camera.near_m, zfar=camera.far_m)
        )

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Colours (H, W, 3) seen from a pose (4, 4)."""
        centred = np.array(world_from_cam, np.float64)
        centred[:3, 3] -= self._centre_m
        self._scene.set_pose(self._camera, centred @ CAM_FROM_GL)
        samples = self._drawn(self._context.colour, self._supersampling, self._background)
        return mean_of_samples(samples, self._supersampling)

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Colours (H, W, 3) and depth (H, W): metres along the optical axis, inf for nothing."""
        rgb = self.render(world_from_cam)
        depth_m = self._drawn(self._context.depth, 1, np.zeros(4))
        return rgb, np.where(depth_m > 0.0, depth_m, np.float32(np.inf))

    def _drawn(self, one_pass: Any, factor: int, background: NDArray[np.float64]) -> Any:
        """What a pass makes of the scene, ``factor`` times as large as the image."""
        self._scene.bg_color = background
        self._context.platform.make_current()
        one_pass.viewport_width, one_pass.viewport_height = (factor * n for n in self._size)
        intrinsics = zip(("fx", "fy", "cx", "cy"), self._intrinsics, strict=True)
        for name, value in intrinsics:
            setattr(self._camera.camera, name, factor * value)
        return one_pass.render(self._scene, self._flags)

    def close(self) -> None:
        """Free the scene's buffers and textures."""
        self._context.platform.make_current()
        self._context.colour.forget(self._scene)
        self._scene.clear()


def mean_of_samples(samples: NDArray[np.uint8], factor: int) -> Rgb:
    """The image (H, W, 3) whose pixels are means of ``factor`` x ``factor`` samples."""
    total = np.zeros((samples.shape[0] // factor, samples.shape[1] // factor, 3), np.uint16)
    for row in range(factor):
        for column in range(factor):
            total += samples[row::factor, column::factor]
    return ((total + factor**2 // 2) // factor**2).astype(np.uint8)


def _primitive(part: MeshPart, centre_m: NDArray[np.float64]) -> Any:
    """One part as vertex buffers around ``centre_m`` and a material."""
    rgba = None
    if part.vertex_rgb is not None:
        rgb = part.vertex_rgb.astype(np.float32) / 255.0
        rgba = np.pad(rgb, ((0, 0), (0, 1)), constant_values=1)
    return _pyrender().Primitive(
        positions=(part.vertices_m - centre_m).astype(np.float32),
        indices=part.faces.astype(np.uint32),
        texcoord_0=None if part.uv is None else part.uv.astype(np.float32),
        color_0=rgba,
        material=_material(part),
    )


def _material(part: MeshPart) -> Any:
    """Base colour and texture; the alpha test is already decided in the texture."""
    pyrender = _pyrender()
    texture = None
    if part.texture is not None:
        pixels = thresholded(part)
        channels = "RGBA" if pixels.shape[2] == 4 else "RGB"
        # Trilinear filtering costs a fifth more and is no closer to the mean of many samples.
        sampler = pyrender.Sampler(minFilter=pyrender.constants.GLTF.LINEAR_MIPMAP_NEAREST)
        texture = pyrender.Texture(sampler=sampler, source=pixels, source_channels=channels)
    return pyrender.MetallicRoughnessMaterial(
        baseColorTexture=texture,
        baseColorFactor=np.append(part.base_color[:3] / 255.0, 1.0),
        doubleSided=True,
    )
