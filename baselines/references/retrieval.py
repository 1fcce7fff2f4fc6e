"""The pose of the training image that looks most alike: what any localizer has to beat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.references.evidence import Evidence
from baselines.references.vectors import THUMBNAIL, VLAD, most_alike


def by_thumbnail(evidence: Evidence) -> NDArray[np.float64]:
    """The label of the training image with the nearest 8 x 8 thumbnail."""
    return nearest_label(evidence, THUMBNAIL)


def by_vlad(evidence: Evidence) -> NDArray[np.float64]:
    """The label of the training image with the nearest DenseVLAD vector."""
    return nearest_label(evidence, VLAD)


def nearest_label(evidence: Evidence, descriptor: str) -> NDArray[np.float64]:
    """Labels (N, 4, 4) of the training images nearest to the test images."""
    train, test = evidence.descriptors[descriptor]
    return evidence.train.world_from_cam[most_alike(train, test, 1)[:, 0]]
