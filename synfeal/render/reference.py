"""What an image should be: the mean over 64 points of each pixel, whatever draws them.

The 64 pinhole images whose principal points differ by eighths of a pixel are, interleaved, one
image with eight times the pixels along each axis. It is drawn as that one image, so that a texture
is filtered over the eighth of a pixel a sample stands for, and not over a whole pixel 64 times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig
from synfeal.render.base import Renderer

SAMPLES_PER_AXIS = 8


def reference_images(
    # opens a renderer for a camera; best one without anti-aliasing of its own
    opened: Callable[[CameraConfig], Renderer],
    camera: CameraConfig,  # at most 1024 pixels wide and high
    poses: Iterable[NDArray[np.float64]],  # ``world_from_cam``
) -> Iterator[NDArray[np.float32]]:
    """Colours (H, W, 3) in 0 to 255, not rounded, seen from each pose (4, 4)."""
    with opened(magnified(camera, SAMPLES_PER_AXIS)) as renderer:
        for world_from_cam in poses:
            yield box_means(renderer.render(world_from_cam), SAMPLES_PER_AXIS)


def magnified(camera: CameraConfig, factor: int) -> CameraConfig:
    """The camera with every pixel split into ``factor`` by ``factor``."""
    fx, fy, cx, cy = (factor * value for value in camera.intrinsics)
    size = {"width": factor * camera.width, "height": factor * camera.height}
    return CameraConfig.model_validate(
        {**camera.model_dump(), **size, "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    )


def box_means(image: NDArray[np.uint8], factor: int) -> NDArray[np.float32]:
    """Means (H, W, 3) of the blocks of ``factor`` by ``factor`` pixels of an image."""
    height, width, channels = image.shape
    blocks = image.reshape(height // factor, factor, width // factor, factor, channels)
    return np.asarray(blocks.mean(axis=(1, 3), dtype=np.float32))
