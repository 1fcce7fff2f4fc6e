"""Photographs resampled to the camera of the training frames.

Two cameras with one centre see the same rays, so what one took follows from what the other took by
moving pixels: through the pinhole model a homography, and the lens on either side. A focal length
that is wrong by a tenth moves every estimate by a tenth of the distance to what is seen.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from torch import nn

from baselines.training.checkpoint import FrameCamera
from synfeal.camera.calibration import Calibration
from synfeal.camera.distortion import distort, fold_radius, undistort

Array = NDArray[np.float64]
# Just within the radius at which a lens folds over; what lies beyond it shows is not known.
WITHIN_FOLD = 0.999


class Resampler:
    """Takes photographs of one camera to another one with the same centre and axes.

    Pixels are averaged over the area that they cover: the photograph is first made smaller by a
    whole number, then sampled bilinearly twice along each side of a pixel of the target.

    Args:
        source: Camera of the photographs.
        target: Camera of the result.

    Attributes:
        outside: Share of the result that the photographs do not show. It is filled with their
            border, as in training the images that are rotated.
    """

    def __init__(self, source: Calibration, target: FrameCamera) -> None:
        shrinks = min(source.fx / target.fx, source.fy / target.fy)
        self._reduction = max(1, math.floor(shrinks))
        self._samples = 1 if shrinks <= 1 else 2  # along each side of a pixel
        pixels, seen = _source_pixels(source, target, self._samples)
        inside = (pixels > 0) & (pixels < [source.width, source.height])
        self.outside = 1 - float((seen & inside.all(axis=-1)).mean())
        self._size = (source.width, source.height)
        # PIL makes the last row and column of a smaller picture of the pixels that are left.
        reduced = [math.ceil(side / self._reduction) for side in self._size]
        grid = 2 * pixels / self._reduction / reduced - 1
        self._grid = torch.from_numpy(grid.astype(np.float32))[None]

    def __call__(self, image: Image.Image) -> Image.Image:
        """Resample the photograph (RGB, of the source's size) to the target."""
        if image.size != self._size:
            raise ValueError(f"a picture of {image.size} for a camera of {self._size}")
        small = np.array(image.reduce(self._reduction))
        planes = torch.from_numpy(small).permute(2, 0, 1)[None].float()
        sampled = nn.functional.grid_sample(
            planes, self._grid, mode="bilinear", padding_mode="border", align_corners=False
        )
        averaged = nn.functional.avg_pool2d(sampled, self._samples)[0]
        return Image.fromarray(averaged.round().byte().permute(1, 2, 0).numpy())


def _source_pixels(
    source: Calibration, target: FrameCamera, samples: int
) -> tuple[Array, NDArray[np.bool_]]:
    """Map a fine grid of the target's pixels to the source, and mark those that it shows.

    Returns:
        Pixels (rows, columns, 2), finite, and a mask (rows, columns): false where a lens folds over
        before it gets there.
    """
    x = (np.arange(target.width * samples) + 0.5) / samples
    y = (np.arange(target.height * samples) + 0.5) / samples
    pixels = np.stack(np.meshgrid(x, y), axis=-1)
    seen = (pixels - [target.cx, target.cy]) / [target.fx, target.fy]
    if any(target.distortion):
        seen = undistort(seen, target.distortion)
    radius = np.linalg.norm(seen, axis=-1)
    limit = WITHIN_FOLD * fold_radius(source.distortion)
    known = radius <= limit  # not of NaN
    nearest = np.where(known, 1.0, limit / np.maximum(radius, 1e-9))
    seen = np.nan_to_num(seen * nearest[..., None])
    shown = distort(seen, source.distortion) * [source.fx, source.fy] + [source.cx, source.cy]
    return shown, known


def same_view(source: Calibration, target: FrameCamera) -> bool:
    """Check that scaling alone turns the photographs into those of the target camera."""
    x, y = target.width / source.width, target.height / source.height
    scaled = (x * source.fx, y * source.fy, x * source.cx, y * source.cy)
    own = (target.fx, target.fy, target.cx, target.cy)
    lens = [*target.distortion, 0.0, 0.0, 0.0, 0.0, 0.0][:5]
    return np.allclose(scaled, own, rtol=1e-6) and np.allclose(source.distortion, lens, atol=1e-9)
