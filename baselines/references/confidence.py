"""Confidence in a pose from its inliers: could as many matches agree by chance?

After the a-contrario criterion of Moisan and Stival (IJCV 2004; as AC-RANSAC, Moulon et al., ACCV
2012): of *m* matches that are all wrong, and lie anywhere in the image, the expected number of
groups of *n* that nevertheless agree with a pose fixed by three of them is at most

    NFA(n, m) = (m - 3) C(m, n) C(n, 3) p^(n - 3),

where *p* is the probability that one wrong match agrees by chance: the area of a circle of the
largest error over that of the image. There is no threshold to tune: a pose that needs more luck
than a hundredth of a photograph is no luck.

Neighbouring features share their fate: one pattern that occurs twice in the world gives many
matches that agree with each other. So what is counted are not matches but square patches of the
photograph that have any, each once however many of its matches agree; *p* grows with the number of
matches a patch has.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from synfeal.errors import Argument, InputError

PATCHES_ACROSS = 16  # along the longer side of the map's frames
LN10 = math.log(10.0)
# One pose in a hundred with no more support than this is chance.
LEAST_CONFIDENCE = 0.99


def check_confidence(least: float) -> None:
    """Refuse a least confidence that no pose, or every pose, has.

    Raises:
        InputError: It is not between 0 and 1.
    """
    if not 0 < least < 1:
        raise InputError(
            Argument("confidence"), f"must lie between 0 and 1, found {least:g}", "0.99 is usual"
        )


class Support(NamedTuple):
    """Evidence for a pose.

    Attributes:
        inliers: Features of the photograph with a match that agrees with the pose.
        patches: Patches with such a match.
        tried: Patches with any match.
        chance: Mean probability that a wrong pose finds a match of a patch to agree with.
    """

    inliers: int
    patches: int
    tried: int
    chance: float

    @property
    def log10_nfa(self) -> float:
        """Logarithm of the expected number of poses with as much support by chance."""
        n, m = self.patches, self.tried
        if n <= 3:
            return math.inf
        choices = math.log(m - 3) + _ln_choose(m, n) + _ln_choose(n, 3)
        return (choices + (n - 3) * math.log(self.chance)) / LN10

    @property
    def confidence(self) -> float:
        """Confidence from 0 to 1: 1 / (1 + NFA).

        The probability that the pose is no chance, where a photograph of the place is as likely
        beforehand as one wrong pose with this support.
        """
        exponent = min(self.log10_nfa, 300.0)
        return 0.0 if exponent == 300.0 else 1.0 / (1.0 + 10.0**exponent)


NO_SUPPORT = Support(inliers=0, patches=0, tried=0, chance=1.0)


def patches_of(pixel: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.int64]:
    """Number the patches that have matches; return that of each match (m,).

    Args:
        pixel: Positions (m, 2) of the matches, in pixels of an image of ``size``.
        size: Width and height of the image, pixels.
    """
    patch_px = max(size) / PATCHES_ACROSS
    place = np.floor(pixel / patch_px).astype(np.int64)
    if not len(place):
        return np.zeros(0, np.int64)
    across, down = (place - place.min(axis=0)).T
    number = across * (down.max() + 1) + down
    # As numpy.unique counts them, but in one pass: this is asked for every pose that is tried.
    found = np.bincount(number) > 0
    return np.asarray((np.cumsum(found) - 1)[number], np.int64)


def support_of(
    pixel: NDArray[np.float64],
    own: NDArray[np.int64],
    inlier: NDArray[np.bool_],
    size: tuple[int, int],
    max_error_px: float,
) -> Support:
    """Count what speaks for a pose.

    Args:
        pixel: Positions (m, 2) of the matches in the photograph, in pixels of an image of ``size``.
        own: Feature of the photograph that each match (m,) is of.
        inlier: Matches (m,) that agree with the pose.
        size: Width and height of the image, pixels.
        max_error_px: Largest reprojection error of an inlier.
    """
    if not inlier.any():
        return NO_SUPPORT
    patch = patches_of(pixel, size)
    matches = np.bincount(patch)
    single = min(1.0, math.pi * max_error_px**2 / (size[0] * size[1]))
    chance = float(np.mean(1.0 - (1.0 - single) ** matches))
    return Support(
        inliers=len(np.unique(own[inlier])),
        patches=len(np.unique(patch[inlier])),
        tried=len(matches),
        chance=chance,
    )


def _ln_choose(n: int, k: int) -> float:
    return float(gammaln(n + 1) - gammaln(k + 1) - gammaln(n - k + 1))
