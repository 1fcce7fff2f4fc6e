"""A pose between those of the training images that look most alike (DenseVLAD + Inter.).

Sattler, Zhou, Pollefeys and Leal-Taixé ("Understanding the limitations of CNN-based absolute camera
pose regression", CVPR 2019) hold pose regression against this stronger form of retrieval, after
Torii, Sivic and Pajdla ("Visual localization by linear combination of image descriptors", ICCV
workshops 2011). The descriptor of a test image is approximated by an affine combination of those of
the retrieved images, and their poses are combined by the same weights::

    minimise |d - sum_i w_i d_i|^2  subject to  sum_i w_i = 1

Positions are combined as they are. Of rotations, the weighted sum of matrices is projected onto the
nearest rotation, which no choice of signs of quaternions can spoil. Weights may be negative: the
test camera can lie outside of the retrieved ones. Ours are 20 images and a ridge on the weights,
since descriptors of neighbouring frames are nearly dependent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.references.arrays import VLAD, Vectors, most_alike
from baselines.references.evidence import Evidence
from baselines.registry.kinds import ReferenceMethod
from synfeal.geometry.poses import pose_matrix

Array = NDArray[np.float64]

NEAREST = 20
# Of the mean diagonal of the normal equations: weights of images that look the same are shared.
RIDGE = 1e-3
CHUNK = 500  # test images at a time


@ReferenceMethod(
    name="interpolated-vlad",
    title="Interpolated, DenseVLAD",
    rank=3,
    group="images",
    query=("vlad",),
)
def by_interpolation(evidence: Evidence) -> Array:
    """Combine the labels of the training images with the nearest DenseVLAD to poses (N, 4, 4)."""
    with evidence.preparing():
        train, test = evidence.descriptors[VLAD]
    usable = evidence.train.usable_rows
    nearest = usable[most_alike(train[usable], test, NEAREST)]
    labels = evidence.train.world_from_cam
    parts = [slice(start, start + CHUNK) for start in range(0, len(test), CHUNK)]
    return np.concatenate(
        [
            combined(labels[nearest[part]], affine_weights(train[nearest[part]], test[part]))
            for part in parts
        ]
    )


def affine_weights(retrieved: Vectors, query: Vectors) -> Array:
    """Solve for the affine combinations of retrieved descriptors nearest to those of the queries.

    Args:
        retrieved: Descriptors (N, k, D) of the images retrieved for each query.
        query: Descriptors (N, D).

    Returns:
        Weights (N, k) that sum to 1.
    """
    off = retrieved.astype(np.float64) - query.astype(np.float64)[:, None]
    # With weights of sum 1, the residual is the combination of these differences: minimise
    # |w @ off|^2, whose solution is the inverse of its matrix times ones, scaled to sum 1.
    gram = off @ off.transpose(0, 2, 1)
    count = gram.shape[1]
    trace = np.trace(gram, axis1=1, axis2=2)
    # Where all retrieved descriptors are the query's, every combination is as good: equal weights.
    ridge = np.where(trace > np.finfo(float).tiny, RIDGE * trace / count, 1.0)
    gram += ridge[:, None, None] * np.eye(count)
    weights = np.linalg.solve(gram, np.ones((len(gram), count, 1)))[..., 0]
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def combined(world_from_cam: Array, weights: Array) -> Array:
    """Combine poses (N, k, 4, 4) by weights (N, k) that sum to 1 to poses (N, 4, 4)."""
    mean = np.einsum("nk,nkij->nij", weights, world_from_cam)
    u, _, vt = np.linalg.svd(mean[:, :3, :3])
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]  # a rotation, no reflection
    return pose_matrix(u @ vt, mean[:, :3, 3])
