"""Which features of test frames look like which features of training frames."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from baselines.references.arrays import Stored
from baselines.references.features import Features
from baselines.references.vectors import VLAD, most_alike, read_described

# A match's distance over that of the second best (Lowe, IJCV 2004).
RATIO = 0.8


@dataclass(frozen=True)
class Correspondences(Stored):
    """Matches of the test frames, one frame after the other."""

    # (N + 1,) where the matches of each test frame begin; the last is their number C
    start: NDArray[np.int64]
    slope: NDArray[np.float64]  # (C, 2) of the test feature's ray
    # (C,) index of the training feature among those of all training frames
    feature: NDArray[np.int64]
    train: NDArray[np.int64]  # (C,) the training frame it belongs to
    # (C, 3) where that frame's depth says it lies, in its camera's coordinates; not finite where
    # there is no depth
    point_m: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.start) - 1

    def of(self, frame: int) -> slice:
        """The matches of a test frame."""
        return slice(int(self.start[frame]), int(self.start[frame + 1]))


def match_test_frames(
    train: Features, test: Features, retrieved: NDArray[np.int64]
) -> Correspondences:
    """Matches of each test frame with the training frames ``retrieved`` (N, k) for it."""
    slopes, features, counts = [], [], [0]
    for query, rows in enumerate(tqdm(retrieved, "matching", unit="frame", mininterval=5)):
        roots, slope, count = test.roots(query), test.slope[test.of(query)], 0
        for row in rows:
            own, other = mutual_matches(roots, train.roots(int(row)))
            slopes.append(slope[own])
            features.append(train.start[row] + other)
            count += len(own)
        counts.append(count)
    feature = np.concatenate(features)
    frame, point_m = train.frame[feature], train.point_m[feature]
    return Correspondences(np.cumsum(counts), np.concatenate(slopes), feature, frame, point_m)


def mutual_matches(
    own: NDArray[np.float32], other: NDArray[np.float32]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices of unit descriptors (a, D) and (b, D) that are each other's nearest, ratio-tested."""
    if len(own) == 0 or len(other) < 2:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    alike = own @ other.T
    row = np.arange(len(own))
    nearest, back = alike.argmax(axis=1), alike.argmax(axis=0)
    best = alike[row, nearest]
    alike[row, nearest] = -np.inf
    good = 2 - 2 * best < RATIO**2 * (2 - 2 * alike.max(axis=1))
    good &= back[nearest] == row
    rows = np.flatnonzero(good)
    return rows, nearest[rows]


def write_matches(
    descriptors: Path, train: Path, test: Path, retrieved: int, out_matches: Path
) -> None:
    """Match each test frame with the training frames that look most alike, and write the matches.

    Raises:
        InputError: descriptors or features cannot be read.
    """
    of_train, of_test = Features.read(train), Features.read(test)
    described = read_described(descriptors, len(of_train), len(of_test))
    rows = most_alike(*described[VLAD], retrieved)
    match_test_frames(of_train, of_test, rows).write(out_matches)
