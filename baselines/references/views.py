"""What a scene-coordinate network learns from, but for labels: small images, and some depth.

The frames are those with depth, reduced to the size of the localizers' frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from baselines.groundtruth.images import read_image
from baselines.references.arrays import Stored
from baselines.references.features import files_of_split
from synfeal.camera.rays import normalised_of_pixels
from synfeal.config.models import CameraConfig
from synfeal.dataset.archive import FrameFile
from synfeal.dataset.sevenscenes import read_depth_m

Array = NDArray[np.float64]
STRIDE = 4  # pixels between the cells of the network's output


@dataclass(frozen=True)
class Views(Stored):
    """Frames of a split as a scene-coordinate network sees them."""

    images: NDArray[np.uint8]  # (N, h, w, 3) uint8
    # (R, C, 2) x / z and y / z of the ray through the middle of each cell, distortion removed; cell
    # (r, c) is centred on pixel (4 r, 4 c)
    slope: Array
    depth_m: NDArray[np.float32]  # (N, R, C) along the optical axis there, inf where there is none

    def __len__(self) -> int:
        return len(self.images)

    @property
    def point_m(self) -> NDArray[np.float32]:
        """Points (N, R, C, 3) in camera coordinates; not finite where there is no depth."""
        ray = np.concatenate([self.slope, np.ones((*self.slope.shape[:2], 1))], axis=-1)
        return np.asarray(ray * self.depth_m[..., None], dtype=np.float32)


def write_views(
    sequences: Sequence[Path],
    split: str,
    n_frames: int,
    camera: CameraConfig,
    side: tuple[int, int],
    out_views: Path,
) -> None:
    """Reduce the first frames of a split to ``side`` (width, height), and write them.

    Raises:
        InputError: a sequence or an image cannot be read.
    """
    files = files_of_split(sequences, split, n_frames)
    read_frames(*files, camera, *side).write(out_views)


def read_frames(
    color_paths: Sequence[FrameFile],
    depth_paths: Sequence[FrameFile] | None,
    camera: CameraConfig,
    width: int,
    height: int,
) -> Views:
    """Frames of ``camera`` reduced to ``width`` x ``height``, with depth where there are images.

    Raises:
        InputError: an image cannot be read or is not of the camera's size.
    """
    pixel = cell_pixels(camera, width, height)
    column, row = np.moveaxis(pixel.astype(int), -1, 0)
    images = np.empty((len(color_paths), height, width, 3), np.uint8)
    depth_m = np.full((len(color_paths), *column.shape), np.inf, np.float32)
    for index, color in enumerate(tqdm(color_paths, "views", unit="frame", mininterval=5)):
        full = read_image(color, camera, "RGB")
        images[index] = cv2.resize(full, (width, height), interpolation=cv2.INTER_AREA)
        if depth_paths is not None:
            depth_m[index] = read_depth_m(depth_paths[index])[row, column]
    return Views(images, normalised_of_pixels(camera, pixel), depth_m)


def cell_pixels(camera: CameraConfig, width: int, height: int) -> Array:
    """Where the middles (R, C, 2) of the cells of a reduced image lie in the camera's image.

    The first pixel's centre is at (0.5, 0.5) in both.
    """
    column, row = np.meshgrid(np.arange(0, width, STRIDE) + 0.5, np.arange(0, height, STRIDE) + 0.5)
    return np.stack([column * camera.width / width, row * camera.height / height], axis=-1)
