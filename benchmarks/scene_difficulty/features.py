"""SIFT features of single frames, found as the SfM baseline finds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap
from numpy.typing import NDArray
from PIL import Image


@dataclass(frozen=True)
class Features:
    """Features of one frame, strongest scale first.

    Attributes:
        pixel: (k, 2) positions; the centre of the top-left pixel is (0.5, 0.5).
        descriptor: (k, 128) uint8, of one length but for rounding.
    """

    pixel: NDArray[np.float32]
    descriptor: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.pixel)

    def first(self, count: int) -> Features:
        """The ``count`` features of the largest scales: what SIFT's own limit keeps."""
        return Features(self.pixel[:count], self.descriptor[:count])


def extract_features(color_paths: Sequence[Path], max_features: int) -> list[Features]:
    """Features of images."""
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    options = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    options.sift.max_num_features = max_features
    extractor = pycolmap.FeatureExtractor.create(options, pycolmap.Device.cpu)
    found = []
    for path in color_paths:
        with Image.open(path) as image:
            grey = np.asarray(image.convert("L"))
        keypoints, descriptors = extractor.extract_from_uint8_array(grey)
        # Columns x, y, scale, orientation.
        matrix = pycolmap.keypoints_to_matrix(keypoints).reshape(-1, 4)
        order = np.argsort(-matrix[:, 2], kind="stable")
        descriptor = np.asarray(descriptors.data, np.uint8).reshape(-1, 128)
        found.append(Features(matrix[order, :2], descriptor[order]))
    return found
