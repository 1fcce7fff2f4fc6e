"""Retrieved image pairs of one batch: similar images far apart in time.

Neighbours in time tie a straight path together like the links of a chain: nothing holds its ends.
A batch consists of several paths through one room, so what one path has seen another sees again.
Such pairs are retrieved by comparing small copies of the images and close the loops that keep a
model from bending.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray
from PIL import Image

from baselines.config.labels import SfmConfig
from baselines.labels.batches import read_image
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import FrameFile

Pairs = list[tuple[int, int]]

# Width and height of the small copies: coarse enough that a camera a step aside sees the same one.
THUMBNAIL_SIZE = (32, 24)
# Frames that are nearer in time are matched anyway, see ``overlap`` and ``quadratic_overlap``.
MIN_FRAMES_APART = 16
# Frames so near to one that was chosen show the same again, and leave no room for other places.
SUPPRESSED_FRAMES = 4


def thumbnails(color_paths: Sequence[FrameFile], camera: CameraConfig) -> NDArray[np.float32]:
    """Describe images by small grey copies of them.

    Args:
        color_paths: Images of the camera's size, in order.
        camera: Their camera.

    Returns:
        Unit vectors (N, 768) without their mean; zeros for an image of one grey level.

    Raises:
        InputError: an image is missing, cannot be read, or has another size.
    """
    small = [
        Image.fromarray(read_image(path, camera, "L")).resize(THUMBNAIL_SIZE, Image.Resampling.BOX)
        for path in color_paths
    ]
    vectors = np.array([np.asarray(image, np.float32).ravel() for image in small])
    vectors -= vectors.mean(axis=1, keepdims=True)
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-6), dtype=np.float32)


def retrieved_pairs(
    descriptors: NDArray[np.float32],
    count: int,
    min_frames_apart: int = MIN_FRAMES_APART,
    suppressed_frames: int = SUPPRESSED_FRAMES,
) -> Pairs:
    """Pair every frame with those that look most like it and are far away in time.

    Frames are chosen one by one, the most alike first. One that is near in time to a frame chosen
    before is passed over.

    Args:
        descriptors: Unit vectors (N, D), one per frame, in the order of time.
        count: Most frames to choose for each frame.
        min_frames_apart: Only frames that are more than so many away are chosen.
        suppressed_frames: Frames up to so many from a chosen one are passed over.

    Returns:
        Pairs (i, j) with i < j, each once, in ascending order.
    """
    frames = np.arange(len(descriptors))
    likeness = descriptors @ descriptors.T
    pairs = set()
    for frame in frames.tolist():
        open_ = np.abs(frames - frame) > min_frames_apart
        for _ in range(count):
            if not open_.any():
                break
            other = int(np.argmax(np.where(open_, likeness[frame], -np.inf)))
            pairs.add((min(frame, other), max(frame, other)))
            open_ &= np.abs(frames - other) > suppressed_frames
    return sorted(pairs)


def match_retrieved(
    database: Path, names: Sequence[str], pairs: Pairs, cfg: SfmConfig, seed: int
) -> None:
    """Add verified matches of pairs of images to a database.

    Args:
        database: COLMAP database with the features of all images.
        names: Names of the images in the database, in the order of the frames.
        pairs: Pairs of frames.
        cfg: Matching options.
        seed: Seed of RANSAC.
    """
    if not pairs:
        return
    listed = database.with_name("pairs.txt")
    lines = [f"{names[i]} {names[j]}\n" for i, j in pairs]
    listed.write_text("".join(lines), encoding="utf-8")
    pycolmap.match_image_pairs(
        database,
        matching_options(cfg),
        pycolmap.ImportedPairingOptions(match_list_path=listed),
        verification_options(cfg, seed),
        device=pycolmap.Device.cpu,
    )


def matching_options(cfg: SfmConfig) -> pycolmap.FeatureMatchingOptions:
    """Return the options of all matching: one thread makes it repeatable."""
    return pycolmap.FeatureMatchingOptions(
        num_threads=1, use_gpu=False, guided_matching=cfg.guided_matching
    )


def verification_options(cfg: SfmConfig, seed: int) -> pycolmap.TwoViewGeometryOptions:
    """Return the options of the geometric verification; ``seed`` is that of RANSAC."""
    verification = pycolmap.TwoViewGeometryOptions(min_num_inliers=cfg.min_num_inliers)
    verification.ransac.random_seed = seed
    return verification
