"""What the rest of the project knows of a renderer."""

from __future__ import annotations

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import RenderConfig

Rgb = NDArray[np.uint8]
Depth = NDArray[np.float32]
DEFAULT_SUPERSAMPLING = RenderConfig().supersampling


class Renderer(Protocol):
    """Unlit images of one mesh through one camera.

    What draws a mesh takes ``(mesh, camera, supersampling, background_rgb)``: the camera without
    distortion, samples per pixel along each axis of the image, the colour where nothing is.
    """

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Colours (H, W, 3) seen from a pose (4, 4)."""
        ...

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Colours (H, W, 3) and depth (H, W): metres along the optical axis, inf for nothing."""
        ...

    def close(self) -> None:
        """Give the mesh's memory back; the renderer must not be used afterwards."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
