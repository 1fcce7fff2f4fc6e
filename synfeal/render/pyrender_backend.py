"""Rendering with pyrender on EGL: a GPU where there is one, Mesa's software renderer elsewhere.

Images are unlit, since the light of a reconstruction is in its texture; surfaces show from both
sides; textures are mip-mapped and edges multi-sampled, so that small images do not alias.

pyrender cannot test alpha in unlit renders. Instead each alpha-tested texture is thresholded at its
cutoff and OpenGL turns what alpha remains after filtering into sample coverage: the same cut-outs,
with smooth edges, and exact depth.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.models import CameraConfig
from synfeal.errors import InputError
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render.base import Depth, Rgb

# Mesa's software renderer silently draws nonsense from a buffer of 2^24 vertices on.
MOST_VERTICES = 1 << 23
# OpenGL cameras are x right, y up, z backward; ours are x right, y down, z forward.
CAM_FROM_GL: NDArray[np.float64] = np.diag([1.0, -1.0, -1.0, 1.0])


@functools.cache
def _pyrender() -> Any:
    """The pyrender module, set up for EGL and for the installed NumPy."""
    os.environ["PYOPENGL_PLATFORM"] = "egl"
    np.__dict__.setdefault("infty", np.inf)  # gone in NumPy 2, used by pyrender
    import pyrender

    return pyrender


@functools.cache
def _offscreen() -> Any:
    """The one off-screen renderer of this process.

    Deleting one terminates the EGL display all others share, so it is made once and kept.

    Raises:
        InputError: there is no EGL, or it offers no device.
    """
    try:
        offscreen = _pyrender().OffscreenRenderer(16, 16)
        _configure_context()
    except Exception as error:  # what is missing decides what is raised
        raise InputError(
            f"rendering needs EGL, which does not work here ({type(error).__name__}: {error});"
            " on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri"
        ) from error
    return offscreen


def _configure_context() -> None:
    """Set what pyrender leaves at its default, in the context that was just made current."""
    from OpenGL import GL

    GL.glEnable(GL.GL_SAMPLE_ALPHA_TO_COVERAGE)
    # Texture rows are packed; by default OpenGL expects each to start at a multiple of 4 bytes,
    # which shears textures of odd width.
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)


class PyrenderRenderer:
    """Implements :class:`synfeal.render.base.Renderer`; several may live in one process."""

    def __init__(self, mesh: TexturedMesh, camera: CameraConfig) -> None:
        self._offscreen = _offscreen()
        pyrender = _pyrender()
        self._flags = pyrender.RenderFlags.FLAT | pyrender.RenderFlags.SKIP_CULL_FACES
        self._size = (camera.width, camera.height)
        self._scene = pyrender.Scene(bg_color=np.zeros(4))
        # Vertex buffers hold single precision: exact around the scene's own centre, wherever it is.
        self._centre_m = mesh.bounds_m.mean(axis=0)
        parts = [piece for part in mesh.parts if part.is_drawn for piece in pieces(part)]
        self._scene.add(pyrender.Mesh([_primitive(part, self._centre_m) for part in parts]))
        self._camera = self._scene.add(
            pyrender.IntrinsicsCamera(
                *intrinsics_of(camera), znear=camera.near_m, zfar=camera.far_m
            )
        )

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Colours (H, W, 3) seen from a pose (4, 4); black where nothing is."""
        return self.render_rgbd(world_from_cam)[0]

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Colours (H, W, 3) and depth (H, W): metres along the optical axis, inf for nothing."""
        centred = np.array(world_from_cam, np.float64)
        centred[:3, 3] -= self._centre_m
        self._scene.set_pose(self._camera, centred @ CAM_FROM_GL)
        self._offscreen.viewport_width, self._offscreen.viewport_height = self._size
        rgb, depth = self._offscreen.render(self._scene, flags=self._flags)
        return np.ascontiguousarray(rgb), np.where(depth > 0.0, depth, np.float32(np.inf))

    def close(self) -> None:
        """Drop the scene; its buffers are freed when another scene is rendered."""
        self._scene.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def pieces(part: MeshPart, most_vertices: int = MOST_VERTICES) -> Iterator[MeshPart]:
    """The part in pieces of at most ``most_vertices``, each with the vertices of its own faces."""
    if len(part.vertices_m) <= most_vertices:
        yield part
        return
    step = max(1, most_vertices // 3)
    for start in range(0, len(part.faces), step):
        used, faces = np.unique(part.faces[start : start + step], return_inverse=True)
        yield replace(
            part,
            vertices_m=part.vertices_m[used],
            faces=faces.reshape(-1, 3),
            uv=None if part.uv is None else part.uv[used],
            vertex_rgb=None if part.vertex_rgb is None else part.vertex_rgb[used],
        )


def _primitive(part: MeshPart, centre_m: NDArray[np.float64]) -> Any:
    """One part as vertex buffers around ``centre_m`` and a material."""
    pyrender = _pyrender()
    return pyrender.Primitive(
        positions=(part.vertices_m - centre_m).astype(np.float32),
        indices=part.faces.astype(np.uint32),
        texcoord_0=None if part.uv is None else part.uv.astype(np.float32),
        color_0=_vertex_rgba(part),
        material=_material(part),
    )


def _vertex_rgba(part: MeshPart) -> NDArray[np.float32] | None:
    """Vertex colours (V, 4) in 0 to 1."""
    if part.vertex_rgb is None:
        return None
    opaque = np.ones((len(part.vertex_rgb), 1), np.float32)
    return np.hstack([part.vertex_rgb.astype(np.float32) / 255.0, opaque])


def _material(part: MeshPart) -> Any:
    """Base colour and texture; the alpha test is already decided in the texture."""
    pyrender = _pyrender()
    texture = None
    if part.texture is not None:
        pixels = _thresholded(part)
        channels = "RGBA" if pixels.shape[2] == 4 else "RGB"
        texture = pyrender.Texture(source=pixels, source_channels=channels)
    return pyrender.MetallicRoughnessMaterial(
        baseColorTexture=texture,
        baseColorFactor=np.append(part.base_color[:3] / 255.0, 1.0),
        doubleSided=True,
    )


def _thresholded(part: MeshPart) -> NDArray[np.uint8]:
    """The texture with alpha 0 or 255, or without alpha where the part is opaque.

    Texels that are not drawn take the mean colour of those that are: filtering mixes them in at the
    edges and in every mip level, and their own colour is arbitrary.
    """
    assert part.texture is not None
    if part.texture.shape[2] == 3 or part.alpha_cutoff is None:
        return np.ascontiguousarray(part.texture[..., :3])
    alpha = part.texture[..., 3] / 255.0 * (part.base_color[3] / 255.0)
    drawn = alpha >= part.alpha_cutoff
    rgba = np.dstack([part.texture[..., :3], np.where(drawn, 255, 0).astype(np.uint8)])
    rgba[~drawn, :3] = rgba[drawn, :3].mean(axis=0)
    return rgba
