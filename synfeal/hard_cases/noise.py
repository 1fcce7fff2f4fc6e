"""Injected noise: is its median what the row of the table says, and is no direction preferred?"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.rotations import rotation_angle_rad
from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import max_abs, mpf
from synfeal.labels import noise

Array = NDArray[np.float64]
COUNT = 100_000
NOISE_M = 0.3
# Kolmogorov's distance that one uniform sample in a thousand exceeds, shared by three coordinates.
LARGEST_DISTANCE = float(np.sqrt(-0.5 * np.log(0.001 / 3 / 2) / COUNT))


def position_median() -> Trial:
    """Median Euclidean displacement against the nominal one."""
    return Trial(
        naive=lambda: np.median(_metres(table(), published_displacements())),
        ours=lambda: np.median(_metres(table(), _noisy(NOISE_M, 0.0))),
        truth=mpf(NOISE_M),
        error=lambda answer, truth: max_abs(answer, truth) / NOISE_M,
    )


def position_median_rms() -> Trial:
    """RMS over the axes, the published code's error: sqrt(3) times the nominal displacement."""
    return Trial(
        naive=lambda: np.median(_metres(table(), _noisy(NOISE_M, 0.0))) / np.sqrt(3.0),
        ours=lambda: (
            np.median(_metres(table(), _noisy(NOISE_M * np.sqrt(3.0), 0.0))) / np.sqrt(3.0)
        ),
        truth=mpf(NOISE_M),
        error=lambda answer, truth: max_abs(answer, truth) / NOISE_M,
    )


def orientation_median(noise_deg: float) -> Trial:
    """Median geodesic angle against the nominal one."""
    return Trial(
        naive=lambda: np.median(_degrees(table(), published_turns(noise_deg))),
        ours=lambda: np.median(_degrees(table(), _noisy(0.0, noise_deg))),
        truth=mpf(noise_deg),
        error=lambda answer, truth: max_abs(answer, truth) / noise_deg,
    )


def directions_of_displacements() -> Trial:
    """Distance of their coordinates' distribution from uniform on [-1, 1] (Archimedes)."""
    cube = np.random.default_rng(3).uniform(-1.0, 1.0, (COUNT, 3))
    return Trial(
        naive=lambda: _distance_from_uniform(cube),
        ours=lambda: _distance_from_uniform(_noisy(NOISE_M, 0.0).position_m - table().position_m),
        truth=mpf(0.0),
    )


def directions_of_axes() -> Trial:
    """The same of the axes that orientations are turned about."""
    return Trial(
        naive=lambda: _distance_from_uniform(_turns(table(), published_turns(20.0))),
        ours=lambda: _distance_from_uniform(_turns(table(), _noisy(0.0, 20.0))),
        truth=mpf(0.0),
    )


@cache
def table() -> PoseTable:
    """Random poses."""
    rng = np.random.default_rng(7)
    quat = Rotation.random(COUNT, rng=rng).as_quat(canonical=True, scalar_first=True)
    return PoseTable(np.arange(COUNT), np.arange(COUNT), rng.normal(size=(COUNT, 3)), quat)


def published_displacements() -> PoseTable:
    """Positions displaced as the published code does it: sqrt(3) times the nominal length."""
    step = np.random.default_rng(1).normal(size=(COUNT, 3))
    step *= NOISE_M * np.sqrt(3.0) / np.linalg.norm(step, axis=1, keepdims=True)
    return replace(table(), position_m=table().position_m + step)


def published_turns(noise_deg: float) -> PoseTable:
    """Orientations turned as the published code does it: +-nominal / sqrt(3) on every angle."""
    signs = np.random.default_rng(2).choice([-1.0, 1.0], (COUNT, 3))
    turn = Rotation.from_euler("xyz", noise_deg / np.sqrt(3.0) * signs, degrees=True)
    turned = turn * Rotation.from_quat(table().quat_wxyz, scalar_first=True)
    return replace(table(), quat_wxyz=turned.as_quat(canonical=True, scalar_first=True))


def _noisy(noise_m: float, noise_deg: float) -> PoseTable:
    return noise.add_noise(table(), noise_m, noise_deg, np.random.default_rng(8))


def _metres(clean: PoseTable, noisy: PoseTable) -> Array:
    return np.asarray(np.linalg.norm(noisy.position_m - clean.position_m, axis=1))


def _degrees(clean: PoseTable, noisy: PoseTable) -> Array:
    return np.degrees(rotation_angle_rad(clean.quat_wxyz, noisy.quat_wxyz))


def _turns(clean: PoseTable, noisy: PoseTable) -> Array:
    before, after = (Rotation.from_quat(t.quat_wxyz, scalar_first=True) for t in (clean, noisy))
    return np.asarray((after * before.inv()).as_rotvec())


def _distance_from_uniform(vectors: Array) -> float:
    unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return max(
        float(kstest(column, "uniform", (-1.0, 2.0), method="asymp").statistic) for column in unit.T
    )


_MEDIAN = partial(
    Case,
    "injected noise",
    unit="of the nominal",
    ours="add_noise",
    reference="nominal value",
    bound=0.01,
)
_DIRECTION = partial(
    Case,
    "injected noise",
    quantity="Kolmogorov distance",
    unit="1",
    ours="add_noise",
    reference="uniform on the sphere",
    bound=LARGEST_DISTANCE,
)

CASES = (
    _MEDIAN(
        "position",
        quantity="median distance",
        naive="published code: √3 times the nominal",
        trial=position_median,
    ),
    _MEDIAN(
        "position, measured as the published code does",
        quantity="median RMS of the axes",
        naive="the nominal length, without √3",
        trial=position_median_rms,
    ),
    *(
        _MEDIAN(
            f"orientation, {noise_deg:.0f}°",
            quantity="median angle",
            naive="published code: three Euler angles",
            trial=partial(orientation_median, noise_deg),
        )
        for noise_deg in (5.0, 20.0)
    ),
    _DIRECTION(
        "directions", naive="uniform in a cube, normalised", trial=directions_of_displacements
    ),
    _DIRECTION(
        "axes of turns", naive="published code: three Euler angles", trial=directions_of_axes
    ),
)
