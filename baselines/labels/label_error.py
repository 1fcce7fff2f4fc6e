"""Errors of labels against the true poses, absolute and relative.

Source: J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
Absolute errors are taken as they are: the first label is the true pose, so nothing is aligned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error, relative

Array = NDArray[np.float64]
PoseErrors = tuple[Array, Array]
Pair = tuple[PoseTable, PoseTable]


@dataclass(frozen=True)
class Spread:
    """Errors of many frames in three numbers."""

    median: float
    rmse: float
    max: float


@dataclass(frozen=True)
class RelativeError:
    """Error of the motion over a fixed number of frames.

    Attributes:
        rmse_m: Root mean square of the translation's error, metres.
        rmse_deg: The same of the rotation's, degrees.
        per_metre_m: All errors of translation over all true metres travelled; not a number where
            the camera stands still.
        per_metre_deg: The same of rotation, degrees per metre.
    """

    rmse_m: float
    rmse_deg: float
    per_metre_m: float
    per_metre_deg: float


def absolute_errors(labels: PoseTable, truth: PoseTable) -> PoseErrors:
    """Compute the errors of labels as they are, without aligning them to the truth.

    Args:
        labels: Poses to judge.
        truth: True poses of the same frames, row by row.

    Returns:
        Position errors (N,) in metres and orientation errors (N,) in degrees.
    """
    position_m, orientation_rad = pose_error(labels.world_from_cam, truth.world_from_cam)
    return position_m, np.degrees(orientation_rad)


def spread(errors: Array) -> Spread:
    """Compute the median, root mean square and maximum of errors (N,)."""
    return Spread(float(np.median(errors)), float(np.sqrt(np.mean(errors**2))), float(errors.max()))


def share_within(errors: PoseErrors, limit_m: float, limit_deg: float) -> float:
    """Compute the share of frames whose position and orientation are both within limits.

    Args:
        errors: Position errors (N,) in metres and orientation errors (N,) in degrees.
        limit_m: Largest position error that counts as within, metres.
        limit_deg: Largest orientation error that counts as within, degrees.
    """
    position_m, orientation_deg = errors
    return float(np.mean((position_m <= limit_m) & (orientation_deg <= limit_deg)))


def relative_error(sequences: Sequence[Pair], frames: int) -> RelativeError | None:
    """Compute the error of the motion from each frame to the one ``frames`` further on its path.

    With labels P and true poses Q it is that of ``inverse(inverse(Q_i) Q_j) inverse(P_i) P_j``.

    Args:
        sequences: Labels and true poses of each path.
        frames: Number of frames the motion spans.

    Returns:
        The error over all motions; None where no sequence has more than ``frames`` frames.
    """
    long = [pair for pair in sequences if len(pair[1]) > frames]
    if not long:
        return None
    errors = [pose_error(_motion(p, frames), _motion(q, frames)) for p, q in long]
    error_m = np.concatenate([position_m for position_m, _ in errors])
    error_deg = np.degrees(np.concatenate([orientation_rad for _, orientation_rad in errors]))
    travelled_m = sum(_travelled_m(truth, frames) for _, truth in long)
    per_metre = [e.sum() / travelled_m if travelled_m > 0 else np.nan for e in (error_m, error_deg)]
    return RelativeError(
        spread(error_m).rmse, spread(error_deg).rmse, float(per_metre[0]), float(per_metre[1])
    )


def _travelled_m(truth: PoseTable, frames: int) -> float:
    """Add up the lengths of the true path over each run of ``frames`` frames."""
    steps_m = np.linalg.norm(np.diff(truth.position_m, axis=0), axis=1)
    return float(np.convolve(steps_m, np.ones(frames), "valid").sum())


def _motion(table: PoseTable, frames: int) -> Array:
    """Compute motions ``i_from_j`` (N - frames, 4, 4) with j = i + frames."""
    poses = table.world_from_cam
    return relative(poses[:-frames], poses[frames:])
