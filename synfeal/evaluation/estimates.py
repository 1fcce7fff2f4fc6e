"""Check of the convention of poses.

Formats fix what a pose maps and the order of its quaternion, but people's scripts swap them. Poses
that fit the data set far better when they are read in another way are refused: scored as they
stand, they would pass for a bad localizer's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_list import CONVENTIONS, Convention, PoseList
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]

FAR_BETTER = 5.0  # times, in both medians
# Errors below these are a good reading whatever another would give.
GOOD_M, GOOD_DEG = 0.05, 5.0


def checked_convention(
    path: Path, estimates: PoseList, rows: NDArray[np.int64], reference: Array
) -> None:
    """Refuse poses that another convention fits far better, and name that one.

    Args:
        path: File of the poses, for messages.
        estimates: Poses as the file holds them.
        rows: Those (M,) that belong to a frame.
        reference: ``world_from_cam`` (M, 4, 4) of these frames.

    Raises:
        InputError: another convention fits far better; it says which ``--convention`` to give.
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
    estimates: PoseList, convention: Convention, rows: NDArray[np.int64], reference: Array
) -> tuple[float, float]:
    """Compute median errors, metres and degrees, of the poses that are rotations."""
    poses = estimates.world_from_cam(convention)[rows]
    good = np.isfinite(poses).all(axis=(1, 2))
    if not good.any():
        return np.inf, np.inf
    position_m, angle_rad = pose_error(poses[good], reference[good])
    return float(np.median(position_m)), float(np.degrees(np.median(angle_rad)))


def _text(errors: tuple[float, float]) -> str:
    return f"{errors[0]:.3g} m and {errors[1]:.3g}°"
