"""Vectors that describe images as wholes, as stored, and which of them are nearest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from baselines.references.arrays import read_arrays

Vectors = NDArray[np.float32]
Described = dict[str, tuple[Vectors, Vectors]]

THUMBNAIL, VLAD = "thumbnail", "vlad"
QUERIES = 500  # looked up at a time


def read_described(path: Path, n_train: int, n_test: int, test: str = "test") -> Described:
    """The first vectors of each split by descriptor: smaller data sets are prefixes of larger ones.

    ``test`` names the test frames, where there are several of the same poses.

    Raises:
        InputError: the file cannot be read.
    """
    names = (THUMBNAIL, VLAD)
    stored = read_arrays(path, [f"{name}_{split}" for name in names for split in ("train", test)])
    return {n: (stored[f"{n}_train"][:n_train], stored[f"{n}_{test}"][:n_test]) for n in names}


def most_alike(train: Vectors, test: Vectors, count: int) -> NDArray[np.int64]:
    """Rows (N, count) of the training vectors (M, D) nearest to unit vectors (N, D), best first.

    Where M < count, all of them.
    """
    count = min(count, len(train))
    found = []
    for start in range(0, len(test), QUERIES):
        alike = test[start : start + QUERIES] @ train.T
        best = np.argpartition(-alike, count - 1, axis=1)[:, :count]
        order = np.argsort(-np.take_along_axis(alike, best, axis=1), axis=1, kind="stable")
        found.append(np.take_along_axis(best, order, axis=1))
    return np.concatenate(found).astype(np.int64)
