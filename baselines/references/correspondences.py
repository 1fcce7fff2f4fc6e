"""Matches between test and training frames, and tracks through training frames."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from tqdm import tqdm

from baselines.references.arrays import VLAD, ByFrame, Stored, most_alike, read_described
from baselines.references.costs import write_costs
from baselines.references.features import Features
from synfeal.records.timing import Facts, timed

Rows = NDArray[np.int64]

# A match's distance over that of the second best (Lowe, IJCV 2004).
RATIO = 0.8


@dataclass(frozen=True)
class Correspondences(ByFrame):
    """C matches of the test frames, one frame after the other.

    Attributes:
        slope: (C, 2) of the test feature's ray.
        feature: (C,) index of the training feature among those of all training frames.
        train: (C,) the training frame it belongs to.
        point_m: (C, 3) where that frame's depth says it lies, in its camera's coordinates; not
            finite where there is no depth.
    """

    slope: NDArray[np.float64]
    feature: NDArray[np.int64]
    train: NDArray[np.int64]
    point_m: NDArray[np.float64]


def match_test_frames(
    train: Features, test: Features, retrieved: NDArray[np.int64]
) -> Correspondences:
    """Match each test frame with the training frames that were retrieved for it.

    Args:
        train: Features of all training frames.
        test: Features of the N test frames.
        retrieved: Training frames (N, k) to match with each test frame.
    """
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
    own: NDArray[np.float32], other: NDArray[np.float32], ratio: float = RATIO
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Match descriptors that are each other's nearest and pass the ratio test.

    Args:
        own: Unit descriptors (a, D).
        other: Unit descriptors (b, D).
        ratio: A match passes if its distance is below this share of the distance to the second
            nearest of ``other``.

    Returns:
        Rows of ``own`` and rows of ``other``, both (m,), that match. None where ``other`` has fewer
        than two descriptors.
    """
    if len(own) == 0 or len(other) < 2:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    alike = own @ other.T
    row = np.arange(len(own))
    nearest, back = alike.argmax(axis=1), alike.argmax(axis=0)
    best = alike[row, nearest]
    alike[row, nearest] = -np.inf
    good = 2 - 2 * best < ratio**2 * (2 - 2 * alike.max(axis=1))
    good &= back[nearest] == row
    rows = np.flatnonzero(good)
    return rows, nearest[rows]


def write_matches(
    descriptors: Path,
    train: Path,
    test: Path,
    retrieved: int,
    out_matches: Path,
    out_costs: Path | None = None,
) -> None:
    """Match each test frame with the training frames that look most alike, and write the matches.

    Args:
        descriptors: Global descriptors of both splits.
        train: Features of the training frames.
        test: Features of the test frames.
        retrieved: Number of training frames to match with each test frame.
        out_matches: File of :class:`Correspondences` to write.
        out_costs: JSON to write: processor seconds per test frame, retrieval included; None for
            none.

    Raises:
        InputError: descriptors or features cannot be read.
    """
    of_train, of_test = Features.read(train), Features.read(test)
    described = read_described(descriptors, len(of_train), len(of_test))
    spent: Facts = {}
    with timed(spent, "matches"):
        rows = most_alike(*described[VLAD], retrieved)
        found = match_test_frames(of_train, of_test, rows)
    found.write(out_matches)
    write_costs(out_costs, {"matches": spent["matches"]}, len(of_test))


# Frames that each frame is matched with: those that look most alike, and the next of its path.
ALIKE, NEXT = 10, 2
# Two views must agree on an essential matrix, to this many focal lengths off epipolar lines.
MIN_INLIERS, MAX_SLOPE = 15, 0.01
CONFIDENCE, MAX_TRIALS = 0.999, 500


@dataclass(frozen=True)
class Tracks(Stored):
    """Observations of points by the training frames.

    Attributes:
        frame: (M,) training frame of each observation.
        slope: (M, 2) of its ray.
        track: (M,) index of the point, 0 to T - 1; every point is seen in two frames or more, and
            by none twice.
        of_feature: (K,) the point that a training feature shows, or -1.
    """

    frame: Rows
    slope: NDArray[np.float64]
    track: Rows
    of_feature: Rows

    @property
    def count(self) -> int:
        """Number of points T."""
        return int(self.track.max(initial=-1)) + 1

    def seen_by(self, frames: Rows) -> Tracks:
        """Return the same points without the observations of other frames than these.

        A point that fewer than two of them see shows no feature any more.
        """
        kept = np.isin(self.frame, frames)
        views = np.bincount(self.track[kept], minlength=self.count)
        shown = np.where(self.of_feature >= 0, views[self.of_feature], 0) >= 2
        of_feature = np.where(shown, self.of_feature, -1)
        return Tracks(self.frame[kept], self.slope[kept], self.track[kept], of_feature)


def write_tracks(descriptors: Path, train: Path, out_tracks: Path) -> None:
    """Match training frames with each other, and write the tracks.

    Args:
        descriptors: Global descriptors, which say which frames look alike.
        train: Features of the training frames.
        out_tracks: File of :class:`Tracks` to write.

    Raises:
        InputError: descriptors or features cannot be read.
    """
    features = Features.read(train)
    vectors, _ = read_described(descriptors, len(features), 0)[VLAD]
    alike = most_alike(vectors, vectors, ALIKE + 1)
    find_tracks(features, frame_pairs(alike)).write(out_tracks)


def frame_pairs(alike: Rows) -> Rows:
    """List pairs (P, 2) of frames, i < j, each once: neighbours in looks (N, k), and in time."""
    count = len(alike)
    frame = np.arange(count)
    looks = np.column_stack([np.repeat(frame, alike.shape[1]), alike.ravel()])
    time = [np.column_stack([frame[:-n], frame[n:]]) for n in range(1, NEXT + 1)]
    pairs = np.sort(np.concatenate([looks, *time]), axis=1)
    return np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0)


def find_tracks(features: Features, pairs: Rows) -> Tracks:
    """Find the tracks of the matches of pairs (P, 2) of frames that a rigid motion explains."""
    cv2.setNumThreads(1)
    edges = []
    for i, j in tqdm(pairs, "matching", unit="pair", mininterval=5):
        own, other = mutual_matches(features.roots(i), features.roots(j))
        good = rigid(features.slope[features.of(i)][own], features.slope[features.of(j)][other])
        edges.append(np.column_stack([features.start[i] + own, features.start[j] + other])[good])
    return join_matches(features, np.concatenate(edges))


def rigid(slope_i: NDArray[np.float64], slope_j: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark matches (m, 2), (m, 2) of two views that agree on an essential matrix, if enough do."""
    nothing = np.zeros(len(slope_i), dtype=bool)
    if len(slope_i) < MIN_INLIERS:
        return nothing
    _, mask = cv2.findEssentialMat(
        slope_i, slope_j, np.eye(3), cv2.RANSAC, CONFIDENCE, MAX_SLOPE, MAX_TRIALS
    )
    good = nothing if mask is None else mask.ravel().astype(bool)
    return good if good.sum() >= MIN_INLIERS else nothing


def join_matches(features: Features, matches: Rows) -> Tracks:
    """Form tracks of matches (E, 2) between features; one that a frame sees twice is dropped."""
    total = len(features.slope)
    graph = coo_matrix((np.ones(len(matches), bool), matches.T), shape=(total, total))
    _, component = connected_components(graph, directed=False)
    component = component.astype(np.int64)  # times a number of frames it leaves 32 bits
    frame = features.frame
    size = np.bincount(component, minlength=1)
    seen = np.unique(component * len(features) + frame)  # (component, frame), each once
    frames = np.bincount(seen // len(features), minlength=len(size))
    good = (size >= 2) & (frames == size)
    index = np.where(good, np.cumsum(good) - 1, -1)
    of_feature = index[component]
    kept = of_feature >= 0
    return Tracks(frame[kept], features.slope[kept], of_feature[kept], of_feature)
