"""Scores of poses: medians, means, and the share of frames within bounds.

A frame counts as localized within a bound when its position *and* its orientation error are below
it, as in hloc and ACE. 95 % limits come from a bootstrap over whole paths
(:mod:`synfeal.evaluation.bootstrap`). A frame without a pose has infinite errors: it is never
within a bound, and makes a mean infinite.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import UNIT_TOLERANCE, PoseTable
from synfeal.evaluation.bootstrap import Counts, limits, medians, path_counts
from synfeal.geometry.poses import position_error_m
from synfeal.geometry.rotations import rotation_angle_rad
from synfeal.records.provenance import generator_of

Array = NDArray[np.float64]
Metrics = dict[str, float | None]

POSITION, ORIENTATION = "position_m", "orientation_deg"
MEANS = {POSITION: "position_m_mean", ORIENTATION: "orientation_deg_mean"}
RESAMPLES = 1000


@dataclass(frozen=True)
class Bound:
    """A bound on both errors."""

    position_m: float  # least position error that is outside
    orientation_deg: float  # least orientation error that is outside

    @property
    def _distance(self) -> tuple[str, str]:
        """Number and unit of the first bound, as the field writes it: centimetres below a metre."""
        if self.position_m < 1:
            return f"{100 * self.position_m:g}", "cm"
        return f"{self.position_m:g}", "m"

    @property
    def name(self) -> str:
        """Name of the recall in files: ``recall_5cm_5deg``."""
        return f"recall_{''.join(self._distance)}_{self.orientation_deg:g}deg"

    @property
    def title(self) -> str:
        """As printed: ``5 cm, 5°``."""
        return f"{' '.join(self._distance)}, {self.orientation_deg:g}°"


# 5 cm, 5°: 7-Scenes (Shotton et al., CVPR 2013). 10 cm, 5°: ACE. 25 cm, 2° to 5 m, 10°: the
# visual-localization benchmark (Sattler et al., CVPR 2018). 50 cm, 15°: where regression at a
# twentieth of the paper's frames stands (medians of 0.5 to 1.3 m and 13 to 40 degrees): of the
# stricter ones next to nothing is left there, and 5 m holds a whole room.
BOUNDS = (
    Bound(0.05, 5),
    Bound(0.10, 5),
    Bound(0.25, 2),
    Bound(0.50, 5),
    Bound(0.50, 15),
    Bound(5.0, 10),
)


def pose_errors(predicted: PoseTable, reference: PoseTable) -> dict[str, Array]:
    """Compute ``position_m`` and ``orientation_deg`` (N,); infinite where a prediction failed."""
    good = is_pose(predicted)
    position, orientation = np.full(len(good), np.inf), np.full(len(good), np.inf)
    position[good] = position_error_m(predicted.position_m[good], reference.position_m[good])
    angles = rotation_angle_rad(predicted.quat_wxyz[good], reference.quat_wxyz[good])
    orientation[good] = np.degrees(angles)
    return {POSITION: position, ORIENTATION: orientation}


def is_pose(predicted: PoseTable) -> NDArray[np.bool_]:
    """Mark predictions (N,) that are finite and have a quaternion of unit length.

    Another length is not normalised: a quaternion of zeros, say, has no direction to be brought to.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(np.linalg.norm(predicted.quat_wxyz, axis=1) - 1.0)
        position = np.abs(predicted.position_m).max(axis=1)
    return np.asarray((position < 1e100) & (off <= UNIT_TOLERANCE))


def within(errors: Mapping[str, Array], bound: Bound, end: str = "") -> NDArray[np.bool_]:
    """Mark the frames that are localized within a bound: both errors are below it.

    Args:
        errors: Errors (N,) by name.
        bound: The bound.
        end: Ending of the names, which says what the errors are against, such as ``_true``.

    Returns:
        Marks (N,).
    """
    position, orientation = errors[POSITION + end], errors[ORIENTATION + end]
    return np.asarray((position < bound.position_m) & (orientation < bound.orientation_deg))


def joint_error(errors: Mapping[str, Array], end: str = "") -> Array:
    """Return the larger of centimetres and degrees (N,), as ACE colours frames."""
    return np.maximum(100.0 * errors[POSITION + end], errors[ORIENTATION + end])


def cumulative(errors: Array) -> tuple[Array, Array]:
    """Sort the finite errors, with the percentage of all errors that are at most as large."""
    ordered = np.sort(errors)
    percent = 100 * np.arange(1, len(errors) + 1) / len(errors)
    return ordered[np.isfinite(ordered)], percent[np.isfinite(ordered)]


def summary(errors: Mapping[str, Array], path: NDArray[np.int64]) -> Metrics:
    """Compute median, mean and recalls, each with its limits under ``_low`` and ``_high``.

    None where a value is not finite. ``errors`` are (N,) by name; ``position_m`` and
    ``orientation_deg`` with the same ending (``""``, ``_true``) go together. ``path`` (N,) is what
    the bootstrap draws: the index of each frame's path.
    """
    place, counts = draws(path)
    found = {name: medians(values, place, counts) for name, values in errors.items()}
    for end in (name.removeprefix(POSITION) for name in errors if name.startswith(POSITION)):
        shown = {f"{MEANS[k]}{end}": errors[f"{k}{end}"] for k in MEANS}
        shown |= {f"{b.name}{end}": within(errors, b, end).astype(np.float64) for b in BOUNDS}
        found |= {name: means(values, place, counts) for name, values in shown.items()}
    return with_limits(found)


def with_limits(samples: Mapping[str, Array]) -> Metrics:
    """Return the observed value of each sample, and its limits."""
    metrics: Metrics = {}
    for name, sample in samples.items():
        metrics[name] = finite(float(sample[0]))
        metrics[f"{name}_low"], metrics[f"{name}_high"] = map(finite, limits(sample))
    return metrics


def draws(path: NDArray[np.int64]) -> tuple[NDArray[np.intp], Counts]:
    """Draw whole paths with replacement, for the limits of any mean or median over frames.

    Args:
        path: Index (N,) of each frame's path.

    Returns:
        The column (N,) of each frame's path, and how often each resample takes each path (B, P);
        the first resample takes every path once.
    """
    _, place = np.unique(path, return_inverse=True)
    n_paths = int(place.max()) + 1
    return place, path_counts(n_paths, generator_of("bootstrap", len(path)), RESAMPLES)


def means(values: Array, place: NDArray[np.intp], counts: Counts) -> Array:
    """Average values in each resample of the paths.

    Args:
        values: Value (N,) of each frame.
        place: Column (N,) of ``counts`` that belongs to each frame's path.
        counts: How often each resample takes each path (B, P).

    Returns:
        Means (B,); infinite where a value that is taken is not finite.
    """
    n_paths = counts.shape[1]
    lost = np.bincount(place, ~np.isfinite(values), n_paths)
    total = np.bincount(place, np.where(np.isfinite(values), values, 0.0), n_paths)
    mean = (counts @ total) / (counts @ np.bincount(place, minlength=n_paths))
    return np.where(counts @ lost > 0, np.inf, mean)


def finite(value: float) -> float | None:
    """Return the value, or None (JSON's null) where it is infinite or NaN."""
    return value if math.isfinite(value) else None
