"""Is the convention of a format the one that its poses follow?

Formats fix what a pose maps and the order of its quaternion, but people's scripts swap them. Poses
that fit the data set far better when they are read in another way are refused: scored as they
stand, they would pass for a bad localizer's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.evaluation.estimates import CONVENTIONS, Convention, Estimates
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]

FAR_BETTER = 5.0  # times, in both medians
# Errors below these are a good reading whatever another would give.
GOOD_M, GOOD_DEG = 0.05, 5.0


def checked_convention(
    path: Path, estimates: Estimates, rows: NDArray[np.int64], reference: Array
) -> None:
    """Refuse poses that another convention fits far better.

    Args:
        path: for the message.
        estimates: all poses of the file.
        rows: (M,) those that belong to a frame.
        reference: (M, 4, 4) ``world_from_cam`` of these frames.

    Raises:
        InputError: naming the better convention, for ``--convention``.
    """
    taken = _medians(estimates, estimates.convention, rows, reference)
    if taken[0] < GOOD_M or taken[1] < GOOD_DEG:
        return
    for name, convention in CONVENTIONS.items():
        other = _medians(estimates, convention, rows, reference)
        if all(FAR_BETTER * o < t for o, t in zip(other, taken, strict=True)):
            raise InputError(
                f"{path}: read as {estimates.kind} ({estimates.convention}) it is"
                f" {_text(taken)} off, as {name} {_text(other)}; say which with --convention"
            )


def _medians(
    estimates: Estimates, convention: Convention, rows: NDArray[np.int64], reference: Array
) -> tuple[float, float]:
    """Median errors in metres and degrees of the poses that are rotations."""
    poses = estimates.world_from_cam(convention)[rows]
    good = np.isfinite(poses).all(axis=(1, 2))
    if not good.any():
        return np.inf, np.inf
    position_m, angle_rad = pose_error(poses[good], reference[good])
    return float(np.median(position_m)), float(np.degrees(np.median(angle_rad)))


def _text(errors: tuple[float, float]) -> str:
    return f"{errors[0]:.3g} m and {errors[1]:.3g}°"
