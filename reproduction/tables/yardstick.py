"""Effect of scoring against noisy labels alone, without any harm to the network.

Labels with independent noise are a worse yardstick: the error against them is that against the
truth, with the noise of the test label added. Whoever compares the errors of a network trained on
noisy labels, against those labels, with the errors of one trained on clean labels, measures both at
once. So Table 3 shows what the network trained on *clean* labels scores against the *noisy* ones.

Noise has a fixed length in a direction drawn uniformly, and a fixed angle about an axis drawn
uniformly (``baselines/labels/injected.py``). Of a frame's error only the size is stored, which is
enough, for the angle ``theta`` between error and noise then has a uniform cosine in three
dimensions, whatever the error's direction:

- distances: ``sqrt(e^2 + n^2 + 2 e n cos(theta))``;
- rotations, as unit quaternions: ``cos(half) = cos(e/2) cos(n/2) - sin(e/2) sin(n/2) cos(theta)``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from reproduction.design.experiments import Design, Experiment
from reproduction.statistics.limits import MEASURES, read_errors

Array = NDArray[np.float64]
TABLE = "table3_inconsistencies"
COLUMNS = tuple(f"yardstick_{measure}" for measure in MEASURES[:2])
# Directions of the noise against the error of each frame: midpoints of equal parts of a cosine.
DIRECTIONS = 64


def against_noisy_labels(
    position_m: Array, orientation_deg: Array, noise_m: float, noise_deg: float
) -> tuple[float, float]:
    """Compute median errors against labels with noise, from errors against the truth.

    Args:
        position_m: Position errors of the frames (N,), metres.
        orientation_deg: Their orientation errors (N,), degrees.
        noise_m: Length of the displacement of each test label, metres.
        noise_deg: Angle that each test label is turned by, degrees.

    Returns:
        The median distance in metres and the median angle in degrees, over frames and directions.
    """
    cosines = (2 * np.arange(DIRECTIONS) + 1) / DIRECTIONS - 1
    failed = ~(np.isfinite(position_m) & np.isfinite(orientation_deg))
    position_m, orientation_deg = (
        np.where(failed, 0.0, errors) for errors in (position_m, orientation_deg)
    )
    distances = np.sqrt(
        np.maximum(
            position_m[:, None] ** 2 + noise_m**2 + 2 * noise_m * position_m[:, None] * cosines, 0.0
        )
    )
    half = np.radians(orientation_deg)[:, None] / 2
    half_noise = math.radians(noise_deg) / 2
    half_cosine = np.cos(half) * math.cos(half_noise) - (
        np.sin(half) * math.sin(half_noise) * cosines
    )
    angles = np.degrees(2 * np.arccos(np.clip(np.abs(half_cosine), 0.0, 1.0)))
    distances[failed] = angles[failed] = np.inf
    return float(np.median(distances)), float(np.median(angles))


def yardstick_alone(
    row: Experiment, model: str, design: Design, root: Path
) -> dict[str, float | None]:
    """Compute what noise in the test labels alone does to a cell of Table 3.

    Args:
        row: Row of the table.
        model: Localizer.
        design: Design, which names the runs on clean labels.
        root: Results of the profile.

    Returns:
        Columns ``COLUMNS``, the mean over the runs on clean labels; missing where the row has no
        noise, or where those runs' errors are not stored.
    """
    clean = row.model_copy(update={"labels": "synfeal", "noise_m": 0.0, "noise_deg": 0.0})
    runs = design.runs_of(clean, model) if row.labels == "noise" else []
    files = [root / "runs" / run.directory / "errors.csv" for run in runs]
    if not files or not all(file.is_file() for file in files):
        return dict.fromkeys(COLUMNS)
    return dict(zip(COLUMNS, _means(files, design.moved_m(row), row.noise_deg), strict=True))


def _means(files: Sequence[Path], noise_m: float, noise_deg: float) -> list[float | None]:
    scores = []
    for file in files:
        errors = read_errors(file)
        position_m, orientation_deg = (
            errors[measure].fillna(np.inf).to_numpy() for measure in MEASURES[2:]
        )
        scores.append(against_noisy_labels(position_m, orientation_deg, noise_m, noise_deg))
    means = [fmean(values) for values in zip(*scores, strict=True)]
    return [mean if math.isfinite(mean) else None for mean in means]
