"""Rendering with OpenGL on EGL: a GPU where there is one, Mesa's software renderer elsewhere.

Samples are the pixels of a larger image, averaged on the device. With Mesa's llvmpipe, processor
time of one 640x480 view of a room of 203,000 faces and 16-megapixel textures, 2x2 of them cost
about what 4-fold multi-sampling costs (46 and 41 ms; plain pyrender 60) and come closer to an image
of 64 samples (mean error 0.6 and 0.9 of 255 levels; plain pyrender 1.3), because texture too is
sampled four times. At 128x96 they cost less (6.5 and 10.5 ms). Anisotropic filtering more than
doubles the time in Mesa 22.3 and is further off. Depth, ``1 / gl_FragCoord.w`` at pixel centres, is
a float image and a pass of its own, 9 ms, drawn only when asked for.
``results/benchmarks/rendering.md`` has more.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from functools import cached_property
from itertools import product
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.errors import Argument, InputError
from synfeal.geometry.poses import inverse
from synfeal.mesh.model import TexturedMesh
from synfeal.render.base import (
    DEFAULTS,
    Depth,
    Faces,
    Renderer,
    Rgb,
    UnavailableError,
    Window,
    drawn_pieces,
    faces_of_halves,
    floor_share,
)
from synfeal.render.opengl_part import DevicePart, program_of

# Named in full: searching for them starts a compiler or ldconfig, which a container may lack.
EGL_LIBRARY = "libEGL.so.1"
GL_LIBRARIES = ("libGL.so.1", "libOpenGL.so.0")
MOST_DEVICES = 8
GL_VERSION = 330


@functools.cache
def shared_context() -> Any:
    """Create this process's one moderngl context, on the first EGL device that gives one.

    It is current only while renderers draw, so that other users of OpenGL in the process, such as
    pyrender, find their own.

    Raises:
        UnavailableError: no device works; the first error says why.
    """
    errors: list[Exception] = []
    for device, library in product(range(MOST_DEVICES), GL_LIBRARIES):
        egl: dict[str, Any] = {"backend": "egl", "libegl": EGL_LIBRARY, "libgl": library}
        egl |= {"device_index": device, "require": GL_VERSION, "standalone": True}
        try:
            context: Any = moderngl.create_context(**egl)
        except Exception as error:
            # A missing library or device is a plain ``Exception`` of glcontext, which has no other.
            if type(error) not in (Exception, moderngl.Error):
                raise
            errors.append(error)
        else:
            context.gc_mode = "context_gc"  # what is dropped is released where it is current
            context.__exit__(None, None, None)
            return context
    raise UnavailableError(str(errors[0])) from errors[0]


@functools.cache
def finish() -> Callable[[], None]:
    """Return ``glFinish`` of the current context, which lets other Python threads run meanwhile.

    moderngl's own calls hold the interpreter for the whole frame, and threads that compress images
    starve meanwhile.
    """
    address_of = ctypes.CDLL(EGL_LIBRARY).eglGetProcAddress
    address_of.restype = ctypes.c_void_p
    return ctypes.CFUNCTYPE(None)(address_of(b"glFinish"))


class OpenglRenderer(Renderer):
    """Implements :class:`synfeal.render.base.Renderer`; several may live in one process."""

    def __init__(
        self, mesh: TexturedMesh, camera: CameraConfig, render: RenderConfig = DEFAULTS
    ) -> None:
        """Upload the mesh."""
        self._context = shared_context()
        self._finish = finish()
        self._clip_from_cam = clip_from_cam(camera)
        # Vertex buffers hold single precision: exact around the scene's own centre, wherever it is.
        self._centre_m = mesh.bounds_m.mean(axis=0)
        self._size = (camera.width, camera.height)
        self._supersampling = render.supersampling
        self.draw_only(None)
        self._background = [level / 255.0 for level in render.background_rgb]
        with self._context:
            self._open_images(render.supersampling)
            drawn = list(drawn_pieces(mesh))
            self._parts = [
                DevicePart(self._context, piece, self._centre_m, floor_share(render))
                for piece, _ in drawn
            ]
        # Index in the mesh of each triangle by its number on the device, and of nothing, the last.
        own = [first + part.order for part, (_, first) in zip(self._parts, drawn, strict=True)]
        self._face_of_number = np.concatenate([*own, [-1]]).astype(np.int32)

    def _open_images(self, supersampling: int) -> None:
        """Make the images that are drawn into: samples, their means, and depth."""
        context, size = self._context, self._size
        large = (size[0] * supersampling, size[1] * supersampling)
        limit = context.info["GL_MAX_TEXTURE_SIZE"]
        if max(large) > limit:
            raise InputError(
                Argument("camera"),
                f"{size[0]}x{size[1]} pixels at {supersampling} samples per axis are more than the"
                f" {limit} OpenGL draws here",
                "lower render.supersampling",
            )
        self._samples = context.texture(large, 4)
        depths = (context.depth_renderbuffer(large), context.depth_renderbuffer(size))
        self._sample_target = context.framebuffer([self._samples], depths[0])
        self._mean_target = context.simple_framebuffer(size, 4)
        metres = context.renderbuffer(size, 1, dtype="f4")
        self._depth_target = context.framebuffer([metres], depths[1])
        program = program_of(context, "cover.vert", "mean.frag", [f"FACTOR {supersampling}"])
        self._mean = context.vertex_array(program, [])

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Render colours (H, W, 3) from a pose ``world_from_cam`` (4, 4)."""
        with self._context:
            return self._draw_color(world_from_cam)

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Render colours (H, W, 3) and depth (H, W), metres along the optical axis or inf."""
        with self._context:
            rgb = self._draw_color(world_from_cam)
            return rgb, self._draw_depth(self._clip_from_mesh(world_from_cam))

    def render_depth(self, world_from_cam: NDArray[np.float64]) -> Depth:
        """Render depth (H, W) alone: metres along the optical axis, inf for nothing."""
        with self._context:
            return self._draw_depth(self._clip_from_mesh(world_from_cam))

    def render_faces(self, world_from_cam: NDArray[np.float64]) -> Faces:
        """Return the index (H, W) of the triangle at the centre of each pixel, -1 for nothing."""
        clip_from_mesh = self._clip_from_mesh(world_from_cam)
        halves = np.empty((*self._size[::-1], 2), np.float32)
        with self._context:
            self._begin(self._face_target)
            first_face = 0
            culled = self._window_from_clip @ clip_from_mesh
            for part in self._parts:
                part.draw(part.faces, clip_from_mesh, culled, first_face)
                first_face += len(part.order)
            self._finish()
            self._face_target.read_into(halves, components=2, dtype="f4", alignment=1)
        return self._face_of_number[faces_of_halves(halves)]

    @cached_property
    def _face_target(self) -> Any:
        """Create the target that numbers of triangles are drawn into; few callers ask for it."""
        halves = self._context.renderbuffer(self._size, 2, dtype="f4")
        return self._context.framebuffer([halves], self._context.depth_renderbuffer(self._size))

    def draw_only(self, window: Window | None) -> None:
        """See :meth:`synfeal.render.base.Renderer.draw_only`."""
        self._window = window
        self._window_from_clip = window_from_clip(window or Window(0, 0, *self._size), self._size)

    def _clip_from_mesh(self, world_from_cam: NDArray[np.float64]) -> NDArray[np.float64]:
        centred = np.array(world_from_cam, np.float64)
        centred[:3, 3] -= self._centre_m
        return np.asarray(self._clip_from_cam @ inverse(centred))

    def _draw_color(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        clip_from_mesh = self._clip_from_mesh(world_from_cam)
        culled = self._window_from_clip @ clip_from_mesh
        camera_m = np.asarray(world_from_cam)[:3, 3] - self._centre_m
        self._begin(self._sample_target, *self._background, per_pixel=self._supersampling)
        for part in self._parts:
            part.light_from(camera_m)
            part.draw(part.color, clip_from_mesh, culled)
        self._mean_target.scissor = self._box(1)
        self._mean_target.use()
        self._context.enable_only(moderngl.NOTHING)
        self._samples.use(0)
        self._mean.render(moderngl.TRIANGLES, vertices=3)
        rgb = np.empty((*self._size[::-1], 3), np.uint8)
        self._finish()
        self._mean_target.read_into(rgb, components=3, alignment=1)
        return rgb

    def _draw_depth(self, clip_from_mesh: NDArray[np.float64]) -> Depth:
        culled = self._window_from_clip @ clip_from_mesh
        self._begin(self._depth_target)
        for part in self._parts:
            part.draw(part.depth, clip_from_mesh, culled)
        depth_m = np.empty(self._size[::-1], np.float32)
        self._finish()
        self._depth_target.read_into(depth_m, components=1, dtype="f4", alignment=1)
        depth_m[depth_m == 0.0] = np.inf
        return depth_m

    def _begin(self, target: Any, *rgb: float, per_pixel: int = 1) -> None:
        """Clear all of a target, and confine what is drawn to the window."""
        target.scissor = None
        target.use()
        self._context.enable_only(moderngl.DEPTH_TEST)
        target.clear(*rgb)
        target.scissor = self._box(per_pixel)

    def _box(self, per_pixel: int) -> tuple[int, int, int, int] | None:
        """The window as OpenGL has it, in samples: first column and row, width and height."""
        if self._window is None:
            return None
        left, top, right, bottom = (per_pixel * edge for edge in self._window)
        return left, top, right - left, bottom - top

    def close(self) -> None:
        """Give the mesh's memory back; the renderer must not be used afterwards."""
        del self._parts, self._mean, self._samples
        del self._sample_target, self._mean_target, self._depth_target
        self.__dict__.pop("_face_target", None)
        with self._context:
            self._context.gc()


def window_from_clip(window: Window, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the map (4, 4) from clip coordinates of an image (width, height) to a part's."""
    matrix = np.eye(4)
    ends = zip(size, window[:2], window[2:], strict=True)
    for axis, (side, low, high) in enumerate(ends):
        matrix[axis, axis] = side / (high - low)
        matrix[axis, 3] = (side - low - high) / (high - low)
    return matrix


def clip_from_cam(camera: CameraConfig) -> NDArray[np.float64]:
    """Return the projection (4, 4) from camera coordinates (x right, y down, z forward).

    The top row of the image comes out as OpenGL's bottom row, which is read first.
    """
    fx, fy, cx, cy = camera.intrinsics
    width, height, near, far = camera.width, camera.height, camera.near_m, camera.far_m
    return np.array(
        [
            [2.0 * fx / width, 0.0, 2.0 * cx / width - 1.0, 0.0],
            [0.0, 2.0 * fy / height, 2.0 * cy / height - 1.0, 0.0],
            [0.0, 0.0, (far + near) / (far - near), -2.0 * far * near / (far - near)],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
