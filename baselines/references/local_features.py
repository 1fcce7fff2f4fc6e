"""Local features of images, and the matches of two of them: what a map finds photographs by."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from baselines.references.correspondences import mutual_matches
from baselines.references.features import roots_of
from baselines.references.repeats import RATIO

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Most features of a frame, and their least contrast (OpenCV's default is 0.04): rendered surfaces
# are smoother than photographs of them.
MAX_FEATURES, CONTRAST = 1000, 0.006


class Described(NamedTuple):
    """Features of one image.

    Attributes:
        pixel: Positions (k, 2) from the principal point, pixels of the map's frames.
        vector: Descriptors (k, D) as they are compared.
    """

    pixel: Array
    vector: NDArray[np.float32]


class LocalFeatures(Protocol):
    """A kind of local features: how they are found in an image, and matched with another's."""

    def detect(self, grey: NDArray[np.uint8]) -> tuple[Array, NDArray[Any]]:
        """Find features of an image.

        Args:
            grey: Grey values (H, W).

        Returns:
            Positions (k, 2) in pixels, the first pixel's centre at (0.5, 0.5), and descriptors
            (k, D) as they are stored.
        """

    def vectors(self, descriptor: NDArray[Any]) -> NDArray[np.float32]:
        """Turn descriptors (k, D) as they are stored into those that are compared."""

    def match(self, own: Described, other: Described) -> tuple[Rows, Rows]:
        """Match the features of two images; return the rows (m,) of both."""


class Sift:
    """RootSIFT with the ratio test, features that are each other's nearest."""

    def __init__(self) -> None:
        cv2.setNumThreads(1)
        self._sift: Any = cv2.SIFT.create(
            MAX_FEATURES, contrastThreshold=CONTRAST, enable_precise_upscale=True
        )

    def detect(self, grey: NDArray[np.uint8]) -> tuple[Array, NDArray[np.uint8]]:
        """Find features of an image; descriptors (k, 128) are stored as bytes."""
        keypoints, descriptor = self._sift.detectAndCompute(grey, None)
        if descriptor is None:
            return np.zeros((0, 2)), np.zeros((0, 128), np.uint8)
        pixel = np.array([point.pt for point in keypoints], dtype=np.float64) + 0.5
        return pixel, descriptor.astype(np.uint8)

    def vectors(self, descriptor: NDArray[Any]) -> NDArray[np.float32]:
        """Compute RootSIFT (k, 128)."""
        return roots_of(descriptor)

    def match(self, own: Described, other: Described) -> tuple[Rows, Rows]:
        """Match descriptors by their distance, whatever their positions."""
        return mutual_matches(own.vector, other.vector, RATIO)
