"""Rendering by casting rays with Embree, on any machine: no OpenGL, no display, no driver.

Slower than OpenGL, and independent of it: samples, texture filtering and alpha tests are those of
the other backends, so the images are the same up to rounding; depth is exact.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.mesh.model import TexturedMesh
from synfeal.render.base import DEFAULTS, Depth, Faces, Renderer, Rgb, Window, floor_share
from synfeal.render.raycast_triangles import Floats, Points, TexturedTriangles, Viewpoint

Look = Callable[[Viewpoint, Floats], NDArray[Any]]
RAYS_AT_ONCE = 1 << 15  # 30 MB


class RaycastRenderer(Renderer):
    """Implements :class:`synfeal.render.base.Renderer`; several may live in one process."""

    def __init__(
        self, mesh: TexturedMesh, camera: CameraConfig, render: RenderConfig = DEFAULTS
    ) -> None:
        """Prepare triangles and textures."""
        self._triangles = TexturedTriangles(mesh)
        self._floor_share = floor_share(render)
        self._camera = camera
        steps = (np.arange(render.supersampling) + 0.5) / render.supersampling
        self._samples_px: Floats = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        self._background = np.array(render.background_rgb, np.float32)
        self._sample_size = 1.0 / render.supersampling
        self._window: Window | None = None

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Render colours (H, W, 3) from a pose ``world_from_cam`` (4, 4)."""
        return self._image(self._colors, world_from_cam, self._samples_px, self._sample_size)

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Render colours (H, W, 3) and depth (H, W), metres along the optical axis or inf."""
        rgb = self.render(world_from_cam)
        # Whether the very centre is cut out.
        return rgb, self._image(self._depth, world_from_cam, np.full((1, 2), 0.5), 0.0)

    def render_faces(self, world_from_cam: NDArray[np.float64]) -> Faces:
        """Return the index (H, W) of the triangle at the centre of each pixel, -1 for nothing."""
        return self._image(self._faces, world_from_cam, np.full((1, 2), 0.5), 0.0)

    def draw_only(self, window: Window | None) -> None:
        """See :meth:`synfeal.render.base.Renderer.draw_only`."""
        self._window = window

    def close(self) -> None:
        """Drop triangles and textures."""
        del self._triangles

    def _image(self, look: Look, pose: Floats, samples_px: Floats, step_px: float) -> NDArray[Any]:
        """Draw what ``look`` sees along the rays through ``samples_px`` (S, 2) of each pixel.

        Rays are (S * P, 3): in the world, of unit length along the optical axis, the first sample
        of all pixels before the second.
        """
        width, height = self._camera.width, self._camera.height
        fx, fy, cx, cy = self._camera.intrinsics
        per_sample = step_px * pose[:3, :2].T / np.array([[fx], [fy]])
        origin_m = pose[:3, 3] - self._triangles.centre_m
        view = Viewpoint(origin_m, per_sample, self._camera.near_m, self._camera.far_m)
        left, top, right, bottom = self._window or (0, 0, width, height)
        every = np.arange(width * height).reshape(height, width)
        drawn = every[top:bottom, left:right].reshape(-1)
        tiles, count = [], RAYS_AT_ONCE // len(samples_px)
        for start in range(0, len(drawn), count):
            index = drawn[start : start + count]
            corners_px = np.stack([index % width, index // width], axis=1)
            x, y = (corners_px + samples_px[:, None]).reshape(-1, 2).T[:, :, None]
            rays = (x - cx) / fx * pose[:3, 0] + (y - cy) / fy * pose[:3, 1] + pose[:3, 2]
            tiles.append(look(view, rays))
        pixels = np.concatenate(tiles)
        if self._window is not None:  # elsewhere any value will do
            image = np.repeat(pixels[:1], width * height, axis=0)
            image[drawn] = pixels
            pixels = image
        return pixels.reshape(height, width, *pixels.shape[1:])

    def _points(self, view: Viewpoint, rays: Floats) -> tuple[NDArray[np.intp], Points]:
        """Find the rays that hit something, and what they hit."""
        face, about_m = self._triangles.first_drawn(view, rays)
        hit = np.flatnonzero(face >= 0)
        return hit, self._triangles.points(view, rays[hit], face[hit], about_m[hit])

    def _depth(self, view: Viewpoint, rays: Floats) -> Depth:
        hit, points = self._points(view, rays)
        depth_m = np.full(len(rays), np.inf, np.float32)
        depth_m[hit] = points.depth_m
        return depth_m

    def _faces(self, view: Viewpoint, rays: Floats) -> Faces:
        return self._triangles.face_of_mesh[self._triangles.first_drawn(view, rays)[0]]

    def _colors(self, view: Viewpoint, rays: Floats) -> Rgb:
        hit, points = self._points(view, rays)
        rgb = np.tile(self._background, (len(rays), 1))
        rgb[hit] = self._triangles.rgb(view, points)
        if self._floor_share < 1.0:
            cosine = self._triangles.view_cosines(points)[:, None]
            rgb[hit] *= self._floor_share + (1.0 - self._floor_share) * cosine
        samples = rgb.reshape(len(self._samples_px), -1, 3)
        return np.asarray(np.round(samples.mean(axis=0)), np.uint8)
