"""Images of cameras that look further round than a plane: faces of a cube, resampled.

As for a lens (:mod:`synfeal.render.distorted`): the faces have twice the resolution of the image's
middle, and each pixel is the mean of 2x2 points, read bilinearly. Far beyond 90 degrees from its
axis a fisheye shows less at a time, and more sharply than it is drawn. Depth is along the ray; each
face's own, along its axis, is read as that of a lens is, so it is exact on planes. Only faces that
the camera sees are drawn, and of each the rectangle that it sees: a fisheye of 120 degrees sees all
of the face ahead, and strips of four others. The clip planes are those of the faces: as near and as
far along their axes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import pixels_per_radian, rays_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.errors import Argument, InputError
from synfeal.render.base import Depth, Faces, Renderer, Rgb, Window
from synfeal.render.distorted import (
    LONGEST_SIDE_PX,
    MARGIN_PX,
    OVERSAMPLING,
    color_matrix,
    pixels_of_rows,
    resampled_depth,
    taps,
)

Array = NDArray[np.float64]
Draw = Callable[[Array], Any]

# Around pixels that are read: their neighbours, whose depth tells planes from edges, and one more.
WINDOW_MARGIN_PX = 2

# Axes of the faces (6, 3, 3) in the camera's frame, as columns: right, down and outwards.
CAM_FROM_FACE: Array = np.stack(
    [
        [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]],  # ahead
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],  # right
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],  # behind
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],  # left
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],  # up
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],  # down
    ]
)


class CubeRenderer(Renderer):
    """Implements :class:`synfeal.render.base.Renderer` around one of perspective images.

    What the lens does not show has the colour of the background and no depth.
    """

    def __init__(
        self,
        open_pinhole: Callable[[CameraConfig], Renderer],
        camera: CameraConfig,
        background_rgb: tuple[int, int, int],
    ) -> None:
        """Open the inner renderer with the camera that :func:`face_camera` gives."""
        self._shape = (camera.height, camera.width)
        face = face_camera(camera)
        rays = rays_of_pixels(camera, pixels_of_rows(camera, range(camera.height), (0.0, 0.0)))
        faces = _faces_of(rays)
        # Corners of pixels may lie on a face that no centre does; the nearest that is drawn has
        # them in its margin.
        self._drawn = np.unique(faces[faces >= 0])
        self._cam_from_face = CAM_FROM_FACE[self._drawn]
        size = (len(self._drawn) * face.height, face.width)
        self._color = color_matrix(
            lambda rows, offset: self._located(
                face, rays_of_pixels(camera, pixels_of_rows(camera, rows, offset))
            ),
            size=self._shape,
            drawn_size=size,
        )
        unseen = 1.0 - np.asarray(self._color.sum(axis=1), np.float32).reshape(-1, 1)
        self._behind = unseen * np.array(background_rgb, np.float32)
        self._depth_taps = taps(self._located(face, rays), face.width)
        self._slant = self._slant_of(rays)
        self._windows = self._windows_of(face)
        self._inner = open_pinhole(face)

    def render(self, world_from_cam: Array) -> Rgb:
        """Render colours (H, W, 3) from a pose ``world_from_cam`` (4, 4)."""
        return self._resampled(np.stack(self._drawn_by(self._inner.render, world_from_cam)))

    def render_rgbd(self, world_from_cam: Array) -> tuple[Rgb, Depth]:
        """Render colours (H, W, 3) and depth (H, W): metres along the ray, inf for nothing."""
        seen = self._drawn_by(self._inner.render_rgbd, world_from_cam)
        rgb, depth_m = (np.stack(images) for images in zip(*seen, strict=True))
        return self._resampled(rgb), self._distance(depth_m)

    def render_depth(self, world_from_cam: Array) -> Depth:
        """Render depth (H, W) alone: metres along the ray, inf for nothing."""
        return self._distance(np.stack(self._drawn_by(self._inner.render_depth, world_from_cam)))

    def render_faces(self, world_from_cam: Array) -> Faces:
        """Return the triangle (H, W) that the nearest pixel of a cube's face shows, or -1."""
        index, weight = self._depth_taps
        nearest = np.take_along_axis(index, weight.argmax(axis=-1)[..., None], axis=-1)[..., 0]
        drawn = np.stack(self._drawn_by(self._inner.render_faces, world_from_cam))
        return np.where(np.isfinite(self._slant), drawn.reshape(-1)[nearest], np.int32(-1))

    def close(self) -> None:
        """Close the inner renderer."""
        self._inner.close()

    def _drawn_by(self, draw: Draw, world_from_cam: Array) -> list[Any]:
        """Draw what is seen of each face, by a method of the inner renderer."""
        images = []
        for pose, window in zip(self._poses(world_from_cam), self._windows, strict=True):
            self._inner.draw_only(window)
            images.append(draw(pose))
        return images

    def _windows_of(self, face: CameraConfig) -> list[Window]:
        """Bound, in each drawn face, the pixels that colours or depth are read from."""
        index, weight = self._depth_taps
        read = np.zeros(len(self._drawn) * face.height * face.width, bool)
        read[self._color.indices[self._color.data > 0.0]] = True
        read[index[weight.any(axis=-1)]] = True
        windows = []
        for image in read.reshape(-1, face.height, face.width):
            rows, columns = (np.flatnonzero(image.any(axis=axis)) for axis in (1, 0))
            windows.append(
                Window(
                    left=max(0, int(columns[0]) - WINDOW_MARGIN_PX),
                    top=max(0, int(rows[0]) - WINDOW_MARGIN_PX),
                    right=min(face.width, int(columns[-1]) + 1 + WINDOW_MARGIN_PX),
                    bottom=min(face.height, int(rows[-1]) + 1 + WINDOW_MARGIN_PX),
                )
            )
        return windows

    def _poses(self, world_from_cam: Array) -> list[Array]:
        """Return the poses of the faces that are drawn."""
        poses = np.repeat(np.asarray(world_from_cam, np.float64)[None], len(self._drawn), axis=0)
        poses[:, :3, :3] = poses[:, :3, :3] @ self._cam_from_face
        return list(poses)

    def _located(self, face: CameraConfig, rays: Array) -> Array:
        """Locate rays (..., 3) in the drawn faces (..., 2), one below the other."""
        towards = np.einsum("...i,fij->...fj", rays, self._cam_from_face)
        slot = np.where(np.isnan(towards[..., 2]), -np.inf, towards[..., 2]).argmax(axis=-1)
        own = np.take_along_axis(towards, slot[..., None, None], axis=-2)[..., 0, :]
        fx, fy, cx, cy = face.intrinsics
        place = own[..., :2] / own[..., 2:] * [fx, fy] + [cx, cy]
        place[..., 1] += slot * face.height
        return np.asarray(place)

    def _slant_of(self, rays: Array) -> NDArray[np.float32]:
        """Return the distance along each ray (H, W) at depth 1 of its face, inf without one."""
        towards = np.einsum("...i,fi->...f", rays, self._cam_from_face[:, :, 2]).max(axis=-1)
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / np.nan_to_num(towards, nan=0.0), np.float32)

    def _resampled(self, faces_rgb: NDArray[np.uint8]) -> Rgb:
        mean = self._color @ faces_rgb.reshape(-1, 3).astype(np.float32) + self._behind
        pixels: Rgb = np.rint(mean).astype(np.uint8).reshape(*self._shape, 3)
        return pixels

    def _distance(self, faces_m: NDArray[np.float32]) -> Depth:
        stacked = faces_m.reshape(-1, faces_m.shape[-1])
        depth_m = resampled_depth(stacked, *self._depth_taps)
        return np.where(np.isfinite(self._slant), depth_m * self._slant, np.float32(np.inf))


def face_camera(camera: CameraConfig) -> CameraConfig:
    """Return the camera of a face: a little over 90 degrees, at least the image's resolution.

    Raises:
        InputError: a face would exceed 8192 pixels.
    """
    finest = max(pixels_per_radian(camera))
    scale = min(OVERSAMPLING, (LONGEST_SIDE_PX / 2 - MARGIN_PX) / finest)
    if scale < 1.0:
        raise InputError(
            Argument("camera"),
            f"faces of a cube with the {finest:.0f} pixels per radian of the image have more than"
            f" {LONGEST_SIDE_PX} pixels a side",
            "give a smaller width",
        )
    focal = finest * scale
    side = max(16, 2 * (int(np.ceil(focal)) + MARGIN_PX))
    lens = {"fx": focal, "fy": focal, "cx": side / 2.0, "cy": side / 2.0}
    plain = {"projection": None, "fisheye_k": None, "stereo_baseline_m": None}
    return camera.model_copy(update={"width": side, "height": side, **lens, **plain})


def _faces_of(rays: Array) -> NDArray[np.int64]:
    """Find the face (...) that each ray (..., 3) meets, -1 where a ray is NaN."""
    towards = rays @ CAM_FROM_FACE[:, :, 2].T
    shown = np.isfinite(towards).all(axis=-1)
    return np.where(shown, np.nan_to_num(towards, nan=0.0).argmax(axis=-1), -1)
