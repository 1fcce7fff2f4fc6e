"""Drawing of a place through the camera of a photograph."""

from __future__ import annotations

import io
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.camera.calibration import Calibration
from synfeal.camera.distortion import undistort
from synfeal.camera.projection import pixels_of_normalised
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.mesh.model import TexturedMesh
from synfeal.render.base import Window
from synfeal.render.choose import open_renderer

Array = NDArray[np.float64]

# What is drawn is as wide as phones' lenses, but for the widest, and as fine as a page shows it.
WIDE = CameraConfig(width=1024, height=1024, horizontal_fov_deg=104.0)
LONGER_PX, QUALITY = 640, 85
BACKGROUND_RGB = (236, 236, 240)  # of the page


class View:
    """Draws a mesh as photographs show it; a context manager, to be used in one thread.

    Every photograph has a camera of its own, and a mesh is uploaded once: it is drawn through one
    wide camera, of which that of the photograph shows a part.

    Args:
        mesh: The mesh.
        mesh_from_map: Rigid motion (4, 4) from the world of the map to that of the mesh.
    """

    def __init__(self, mesh: TexturedMesh, mesh_from_map: Array) -> None:
        self._renderer = open_renderer(mesh, WIDE, RenderConfig(background_rgb=BACKGROUND_RGB))
        self._mesh_from_map = mesh_from_map

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def draw(self, world_from_cam: Array, calibration: Calibration) -> bytes:
        """Draw what a photograph would show, as JPEG; blank beyond the widest lens.

        Args:
            world_from_cam: Its pose (4, 4) in the world of the map.
            calibration: Its camera.
        """
        wanted = shown_pixels(calibration)
        self._renderer.draw_only(_window(wanted))
        drawn = self._renderer.render(self._mesh_from_map @ world_from_cam)
        column, row = np.moveaxis((wanted - 0.5).astype(np.float32), -1, 0)
        image = cv2.remap(drawn, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        stream = io.BytesIO()
        Image.fromarray(np.asarray(image, np.uint8)).save(stream, "JPEG", quality=QUALITY)
        return stream.getvalue()


def shown_pixels(calibration: Calibration) -> Array:
    """Find the pixels (h, w, 2) of the wide camera that the pixels of a photograph show.

    Args:
        calibration: Camera of the photograph, which is made ``LONGER_PX`` long or high.
    """
    scale = LONGER_PX / max(calibration.width, calibration.height)
    width, height = (
        max(1, round(scale * side)) for side in (calibration.width, calibration.height)
    )
    x = (np.arange(width) + 0.5) * calibration.width / width
    y = (np.arange(height) + 0.5) * calibration.height / height
    pixel = np.stack(np.meshgrid(x, y), axis=-1)
    centre = [calibration.cx, calibration.cy]
    slope = undistort((pixel - centre) / [calibration.fx, calibration.fy], calibration.distortion)
    return np.nan_to_num(pixels_of_normalised(WIDE, slope), nan=-1.0)


def _window(pixel: Array) -> Window:
    """Return the part of the wide image that holds pixels (h, w, 2)."""
    low = np.clip(np.floor(pixel.min(axis=(0, 1))) - 1, 0, WIDE.width - 1).astype(int)
    high = np.clip(np.ceil(pixel.max(axis=(0, 1))) + 1, low + 1, WIDE.width).astype(int)
    return Window(int(low[0]), int(low[1]), int(high[0]), int(high[1]))
