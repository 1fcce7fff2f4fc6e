"""Retrieval: the pose of the most similar training image, which a localizer should beat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.references.arrays import THUMBNAIL, VLAD, most_alike
from baselines.references.evidence import Evidence
from baselines.registry.kinds import ReferenceMethod
from synfeal.dataset.pose_table import PoseTable, read_pose_table

CHUNK = 500
# How many metres a radian counts: about the depth at which a room moves as far in the image.
METRES_PER_RADIAN = 1.0


def nearest_label(evidence: Evidence, descriptor: str) -> NDArray[np.float64]:
    """Return the labels (N, 4, 4) of the training images nearest to the test images."""
    with evidence.preparing():
        train, test = evidence.descriptors[descriptor]
    usable = evidence.train.usable_rows
    return evidence.train.world_from_cam[usable[most_alike(train[usable], test, 1)[:, 0]]]


@ReferenceMethod(
    name="nearest-thumbnail",
    title="Nearest image, thumbnails",
    rank=1,
    group="images",
    query=("thumbnail",),
)
def by_thumbnail(evidence: Evidence) -> NDArray[np.float64]:
    """Answer with the label (N, 4, 4) of the training image with the nearest thumbnail."""
    return nearest_label(evidence, THUMBNAIL)


@ReferenceMethod(
    name="nearest-vlad",
    title="Nearest image, DenseVLAD",
    rank=2,
    group="images",
    query=("vlad",),
)
def by_vlad(evidence: Evidence) -> NDArray[np.float64]:
    """Answer with the label (N, 4, 4) of the training image with the nearest DenseVLAD."""
    return nearest_label(evidence, VLAD)


@ReferenceMethod(
    name="nearest-pose",
    title="Nearest training pose (oracle)",
    rank=3,
    group="images",
)
def nearest_pose(evidence: Evidence) -> NDArray[np.float64]:
    """Return the labels (N, 4, 4) of the training frames nearest to the test frames by true pose.

    An oracle: the best that copying a training pose can do.
    """
    usable = evidence.train.usable_rows
    rows = nearest_rows(
        train=read_pose_table(evidence.files["train_truth"]).at(usable),
        test=read_pose_table(evidence.files["test_truth"]),
    )
    return evidence.train.world_from_cam[usable[rows]]


def nearest_rows(train: PoseTable, test: PoseTable) -> NDArray[np.int64]:
    """Find the training pose nearest to each test pose, a radian counting as much as a metre.

    Args:
        train: Training poses.
        test: Test poses (N).

    Returns:
        Rows (N,) of ``train``.
    """
    middle_m = train.position_m.mean(axis=0)  # squares lose their digits far from the origin
    train_m = train.position_m - middle_m
    squares = np.square(train_m).sum(axis=1)
    found = [np.empty(0, np.int64)]
    for start in range(0, len(test), CHUNK):
        test_m = test.position_m[start : start + CHUNK] - middle_m
        square = np.square(test_m).sum(axis=1)[:, None] + squares
        distance_m = np.sqrt(np.maximum(square - 2 * test_m @ train_m.T, 0))
        cosine = np.abs(test.quat_wxyz[start : start + CHUNK] @ train.quat_wxyz.T)
        angle_rad = 2 * np.arccos(np.minimum(cosine, 1))
        found.append(np.argmin(distance_m + METRES_PER_RADIAN * angle_rad, axis=1))
    return np.concatenate(found)
