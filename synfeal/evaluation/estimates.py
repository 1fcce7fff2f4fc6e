"""Check of the convention of poses.

Formats fix what a pose maps and the order of its quaternion, but people's scripts swap them. Poses
that fit the data set far better when they are read in another way are refused: scored as they
stand, they would pass for a bad localizer's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_list import (
    CONVENTIONS,
    OPENGL,
    Convention,
    PoseList,
    named_convention,
)
from synfeal.errors import InputError
from synfeal.geometry.axes import DESCRIPTIONS
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]

FAR_BETTER = 5.0  # times, in both medians, or in that of angles where positions are the same
GOOD_DEG = 5.0  # a good reading whatever another would give


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
    if taken[1] < GOOD_DEG:
        return
    tried = [named_convention(OPENGL, estimates.convention), *CONVENTIONS.values()]
    for convention in tried:
        if estimates.of_matrices and convention.order != estimates.convention.order:
            continue
        other = _medians(estimates, convention, rows, reference)
        same_place = other[0] <= taken[0] * (1 + 1e-9)
        if FAR_BETTER * other[1] < taken[1] and (same_place or FAR_BETTER * other[0] < taken[0]):
            is_opengl = convention == tried[0]
            name = OPENGL if is_opengl else str(convention)
            axes = f" (camera axes {DESCRIPTIONS['opengl']})" * is_opengl
            raise InputError(
                path,
                f"read as {estimates.kind} ({estimates.convention}) it is {_text(taken)} off,"
                f" as {name}{axes} {_text(other)}",
                "say which with `convention`",
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
