"""Features and small views of the frames of a split, shared by all its label sets.

Features are SIFT; OpenCV's implementation takes half the time of COLMAP's for the same matches.
Views are what a scene-coordinate network sees: frames with depth, reduced to the size of the
localizers' frames.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from baselines.config.references import ReferencesConfig
from baselines.labels.batches import read_image
from baselines.references.arrays import ByFrame, Stored
from baselines.references.costs import write_costs
from synfeal.camera.projection import normalised_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.sevenscenes import frames_between
from synfeal.records.timing import Facts, timed
from synfeal.render.base import Depth

log = logging.getLogger(__name__)
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Features(ByFrame):
    """K features of the frames of a split, one frame after the other.

    Attributes:
        slope: (K, 2) x / z and y / z of the rays they lie on, lens distortion removed.
        depth_m: (K,) along the optical axis, inf where there is none; of no use for test frames.
        descriptor: (K, D) as they are stored: of SIFT (K, 128) uint8.
    """

    slope: Array
    depth_m: Array
    descriptor: NDArray[Any]

    @property
    def frame(self) -> NDArray[np.int64]:
        """The frame (K,) of each feature."""
        return np.repeat(np.arange(len(self)), np.diff(self.start))

    @property
    def point_m(self) -> Array:
        """Points (K, 3) in camera coordinates; not finite where there is no depth."""
        return np.column_stack([self.slope, np.ones(len(self.slope))]) * self.depth_m[:, None]

    def points_in_world_m(self, world_from_cam: Array) -> Array:
        """Compute points (K, 3) in the world from the poses (N, 4, 4) of the frames."""
        pose = world_from_cam[self.frame]
        turned = np.einsum("kij,kj->ki", pose[:, :3, :3], self.point_m)
        return np.asarray(turned + pose[:, :3, 3])

    def roots(self, frame: int) -> NDArray[np.float32]:
        """Compute RootSIFT (k, 128) of a frame (Arandjelović and Zisserman, CVPR 2012)."""
        return roots_of(self.descriptor[self.of(frame)])


def roots_of(descriptor: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Compute the RootSIFT descriptors (k, 128) of SIFT descriptors (k, 128)."""
    values = descriptor.astype(np.float32)
    roots = np.sqrt(values / np.maximum(values.sum(axis=1, keepdims=True), 1))
    return np.asarray(roots, dtype=np.float32)


def files_of_split(
    sequences: Sequence[Path], split: str, n_frames: int
) -> tuple[list[FrameFile], list[FrameFile] | None]:
    """List the colour and depth images of the first frames of a split.

    Args:
        sequences: Sequences of the split, from its first one.
        split: ``train`` or ``test``.
        n_frames: Number of frames.

    Returns:
        Colour images and depth images, in order. No depth of a test set: no method may use it.

    Raises:
        InputError: a sequence cannot be read or has no such file.
    """
    color = frames_between(sequences, "color.png", 0, n_frames)
    if split != "train":
        return color, None
    return color, frames_between(sequences, "depth.png", 0, n_frames)


def write_features(
    sequences: Sequence[Path],
    split: str,
    n_frames: int,
    camera: CameraConfig,
    references: ReferencesConfig,
    out_features: Path,
    out_costs: Path | None = None,
) -> None:
    """Find features in the first frames of a split, and write them.

    Args:
        sequences: Sequences of the split, from its first one.
        split: ``train`` or ``test``; depth is read of training frames alone.
        n_frames: Number of frames.
        camera: Camera of the images.
        references: Number and contrast of the features.
        out_features: File of :class:`Features` to write.
        out_costs: JSON to write: processor seconds per frame; None writes none.

    Raises:
        InputError: a sequence or an image cannot be read.
    """
    color, depth = files_of_split(sequences, split, n_frames)
    paths = tqdm(color, "features", unit="frame", mininterval=5)
    greys = (read_image(path, camera, "L") for path in paths)
    depths_m = map(read_depth_m, depth) if depth else None
    spent: Facts = {}
    with timed(spent, "features"):
        found = features_of(greys, depths_m, camera, references)
    found.write(out_features)
    write_costs(out_costs, {"features": spent["features"]}, n_frames)


def features_of(
    greys: Iterable[NDArray[np.uint8]],
    depths_m: Iterator[Depth] | None,
    camera: CameraConfig,
    cfg: ReferencesConfig,
) -> Features:
    """Extract SIFT features of images, with the depth at each.

    Args:
        greys: Grey images (H, W), frame by frame.
        depths_m: Their depth images (H, W), metres; None where there is no depth, which makes that
            of all features infinite.
        camera: Camera of both, whose distortion is removed.
        cfg: Number and contrast of the features.
    """
    cv2.setNumThreads(1)
    sift = cv2.SIFT.create(
        cfg.max_features, contrastThreshold=cfg.contrast, enable_precise_upscale=True
    )
    found = []
    for grey in greys:
        pixel, descriptor = _frame_features(sift, grey)
        depth_m = np.full(len(pixel), np.inf)
        if depths_m is not None:
            column, row = pixel.astype(int).T
            depth_m = next(depths_m)[row, column].astype(np.float64)
        found.append((normalised_of_pixels(camera, pixel), depth_m, descriptor))
    slope, depth, descriptors = (np.concatenate(part) for part in zip(*found, strict=True))
    start = np.cumsum([0, *(len(part[1]) for part in found)])
    return Features(start, slope, depth, descriptors)


def _frame_features(sift: Any, grey: NDArray[np.uint8]) -> tuple[Array, NDArray[np.uint8]]:
    """Detect features: positions (k, 2) in pixels, first centre at (0.5, 0.5), and descriptors."""
    keypoints, descriptor = sift.detectAndCompute(grey, None)
    height, width = grey.shape
    pixel = np.array([point.pt for point in keypoints], dtype=np.float64).reshape(-1, 2) + 0.5
    inside = ((pixel >= 0) & (pixel < [width, height])).all(axis=1)
    descriptor = np.zeros((0, 128)) if descriptor is None else descriptor
    return pixel[inside], descriptor[inside].astype(np.uint8)


STRIDE = 4  # pixels between the cells of the network's output


@dataclass(frozen=True)
class Views(Stored):
    """Frames of a split as a scene-coordinate network sees them.

    Attributes:
        images: (N, h, w, 3) uint8.
        slope: (R, C, 2) x / z and y / z of the ray through the middle of each cell, distortion
            removed; cell (r, c) is centred on pixel (4 r, 4 c).
        depth_m: (N, R, C) along the optical axis there, inf where there is none.
    """

    images: NDArray[np.uint8]
    slope: Array
    depth_m: NDArray[np.float32]

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
    out_costs: Path | None = None,
) -> None:
    """Reduce the first frames of a split to what a scene-coordinate network sees, and write them.

    Args:
        sequences: Sequences of the split, from its first one.
        split: ``train`` or ``test``; depth is read of training frames alone.
        n_frames: Number of frames.
        camera: Camera of the images.
        side: Width and height to reduce images to, pixels.
        out_views: File of :class:`Views` to write.
        out_costs: JSON to write: processor seconds per frame; None writes none.

    Raises:
        InputError: a sequence or an image cannot be read.
    """
    color, depth = files_of_split(sequences, split, n_frames)
    width, height = side
    pixel = output_centres_px(camera, width, height)
    column, row = np.moveaxis(pixel.astype(int), -1, 0)
    images = np.empty((len(color), height, width, 3), np.uint8)
    depth_m = np.full((len(color), *column.shape), np.inf, np.float32)
    spent: Facts = {}
    with timed(spent, "views"):
        for index, path in enumerate(tqdm(color, "views", unit="frame", mininterval=5)):
            full = read_image(path, camera, "RGB")
            images[index] = cv2.resize(full, side, interpolation=cv2.INTER_AREA)
            if depth is not None:
                depth_m[index] = read_depth_m(depth[index])[row, column]
    write_costs(out_costs, {"views": spent["views"]}, len(color))
    Views(images, normalised_of_pixels(camera, pixel), depth_m).write(out_views)


def output_centres_px(camera: CameraConfig, width: int, height: int) -> Array:
    """Compute the pixels of the full image that the network's outputs are of.

    The network sees a reduced image and answers for every ``STRIDE``-th pixel of it along each
    axis, from the first one on.

    Args:
        camera: Camera of the full image.
        width: Width of the reduced image, pixels.
        height: Height of the reduced image, pixels.

    Returns:
        Where the centres of those pixels (R, C, 2) lie in the full image: column and row, pixels,
        of which the first one's centre is at (0.5, 0.5).
    """
    column, row = np.meshgrid(np.arange(0, width, STRIDE) + 0.5, np.arange(0, height, STRIDE) + 0.5)
    return np.stack([column * camera.width / width, row * camera.height / height], axis=-1)
