"""Motions between neighbouring frames, and between keyframes that view the same place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from baselines.groundtruth.features import FeatureOdometry, FrameFeatures
from baselines.groundtruth.rgbd.dense import (
    FIRM_CONSTRAINT,
    MIN_CONSTRAINT,
    SURE_AGREEMENT,
    DenseOdometry,
    Motion,
)
from baselines.groundtruth.rgbd.frames import RgbdFrame
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]

# Inliers below which features are no starting point for a neighbour, and for a loop closure.
_MIN_INLIERS, _MIN_LOOP_INLIERS = 8, 12
# Depth has slid when it says something else than at least so many features: metres, and a share of
# the motion. Neighbours 3 cm apart whose features were right to 3 mm were up to 4 cm off by depth.
_MIN_WITNESSES, _SLIDE_M, _SLIDE_SHARE = 100, 0.008, 0.04


@dataclass(frozen=True)
class View:
    """A frame and what is found out about it once, when it is needed."""

    frame: RgbdFrame
    dense: DenseOdometry
    by_features: FeatureOdometry

    @cached_property
    def features(self) -> FrameFeatures:
        """Features of the colour image."""
        grey = np.asarray(Image.fromarray(self.frame.color).convert("L"))
        return self.by_features.features(grey, self.frame.depth_m)

    @cached_property
    def constraint(self) -> float:
        """How well dense odometry can tell every motion from this view."""
        return self.dense.constraint(self.frame)

    @property
    def constrained(self) -> bool:
        """Whether dense odometry can tell every motion from this view."""
        return self.constraint >= MIN_CONSTRAINT

    @property
    def firm(self) -> bool:
        """Whether dense odometry tells every motion so well that nothing has to check it."""
        return self.constraint >= FIRM_CONSTRAINT

    def match(self, other: View) -> tuple[Array | None, int]:
        """Motion ``self_from_other`` (4, 4) by features alone and its inliers, or None and 0."""
        return self.by_features.motion(self.features, other.features) or (None, 0)

    def from_features(self, other: View, min_inliers: int) -> Array | None:
        """Motion ``self_from_other`` (4, 4) by at least so many features, or None."""
        motion, inliers = self.match(other)
        return motion if inliers >= min_inliers else None


def neighbour(i: View, j: View, previous: Array) -> tuple[Array, bool]:
    """Motion ``i_from_j`` (4, 4) between neighbours and whether it was accepted.

    Args:
        i: the frame before.
        j: the frame.
        previous: motion (4, 4) of the pair before.
    """
    if not (i.constrained and j.constrained):
        return _by_features(i, j, previous)
    best: Motion | None = None
    if i.dense.cfg.start != "features":
        start = previous if i.dense.cfg.start == "motion" else np.eye(4)
        best = i.dense.refine(i.frame, j.frame, start)
    is_sure = best is not None and best.agreement >= SURE_AGREEMENT
    if best is not None and is_sure and i.firm and j.firm:
        return best.i_from_j, True
    by_features, inliers = i.match(j)
    if by_features is None or inliers < _MIN_INLIERS:
        by_features = previous
    if not is_sure:
        best = _better(best, i.dense.refine(i.frame, j.frame, by_features))
    if best is None:
        return by_features, False
    if inliers >= _MIN_WITNESSES and _slid(best.i_from_j, by_features):
        return by_features, i.dense.overlap(i.frame, j.frame, by_features) > 0
    return best.i_from_j, True


def _better(a: Motion | None, b: Motion | None) -> Motion | None:
    """The motion under which more of the depth agrees; the first of equals."""
    found = [motion for motion in (a, b) if motion is not None]
    return max(found, key=lambda motion: motion.agreement, default=None)


def _slid(by_depth: Array, by_features: Array) -> bool:
    """Whether two motions (4, 4) differ by more than features are off."""
    difference_m, _ = pose_error(by_features, by_depth)
    return bool(difference_m > _SLIDE_M + _SLIDE_SHARE * np.linalg.norm(by_features[:3, 3]))


def _by_features(i: View, j: View, previous: Array) -> tuple[Array, bool]:
    """Before a surface that depth slides along, features alone give the motion.

    Open3D compares colours at whole pixels and would move it away again.
    """
    found = i.from_features(j, _MIN_INLIERS)
    if found is None:
        return previous, False
    return found, i.dense.overlap(i.frame, j.frame, found) > 0


def closure(i: View, j: View, predicted: Array | None) -> Array | None:
    """Motion ``i_from_j`` (4, 4) between keyframes, or None.

    Args:
        i: the earlier one.
        j: the later one.
        predicted: motion (4, 4) by odometry, None where it was interrupted between them.
    """
    if not (i.constrained and j.constrained):
        found = i.from_features(j, _MIN_LOOP_INLIERS)
        return found if found is not None and i.dense.overlap(i.frame, j.frame, found) else None
    start = i.from_features(j, _MIN_LOOP_INLIERS) if predicted is None else predicted
    if start is None:
        return None
    motion = i.dense.refine(i.frame, j.frame, start)
    return None if motion is None else motion.i_from_j
