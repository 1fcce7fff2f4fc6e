"""Injected noise: is its median the nominal one, and is no direction preferred?"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.rotations import rotation_angle_rad
from synfeal.labels import noise
from synfeal.report.hard_cases.case import Trial
from synfeal.report.hard_cases.exact import mpf

Array = NDArray[np.float64]
COUNT, NOISE_M = 20_000, 0.3
# Kolmogorov's distance that one uniform sample in a thousand exceeds, shared by three coordinates.
LARGEST_DISTANCE = float(np.sqrt(-0.5 * np.log(0.001 / 3 / 2) / COUNT))


@cache
def clean() -> PoseTable:
    """Random poses."""
    rng = np.random.default_rng(7)
    quat = Rotation.random(COUNT, rng=rng).as_quat(canonical=True, scalar_first=True)
    return PoseTable(np.arange(COUNT), np.arange(COUNT), rng.normal(size=(COUNT, 3)), quat)


def _noisy(noise_m: float, noise_deg: float) -> PoseTable:
    return noise.add_noise(clean(), noise_m, noise_deg, np.random.default_rng(8))


def _published_turns(noise_deg: float) -> PoseTable:
    """Orientations turned as the published code does it: +-nominal / sqrt(3) on every angle."""
    signs = np.random.default_rng(2).choice([-1.0, 1.0], (COUNT, 3))
    turn = Rotation.from_euler("xyz", noise_deg / np.sqrt(3.0) * signs, degrees=True)
    turned = turn * Rotation.from_quat(clean().quat_wxyz, scalar_first=True)
    return replace(clean(), quat_wxyz=turned.as_quat(canonical=True, scalar_first=True))


def median_displacement() -> Trial:
    """Median displacement as a share of the nominal one; the published code's is sqrt(3) times."""
    step = np.random.default_rng(1).normal(size=(COUNT, 3))
    step *= np.sqrt(3.0) / np.linalg.norm(step, axis=1, keepdims=True)

    def ours() -> Any:
        moved_m = _noisy(NOISE_M, 0.0).position_m - clean().position_m
        return np.median(np.linalg.norm(moved_m, axis=1)) / NOISE_M

    return Trial(lambda: np.median(np.linalg.norm(step, axis=1)), ours, truth=mpf(1.0))


def median_turn(noise_deg: float) -> Trial:
    """Median geodesic angle as a share of the nominal one."""

    def share(noisy: PoseTable) -> Any:
        angles = rotation_angle_rad(clean().quat_wxyz, noisy.quat_wxyz)
        return np.median(np.degrees(angles)) / noise_deg

    return Trial(
        naive=lambda: share(_published_turns(noise_deg)),
        ours=lambda: share(_noisy(0.0, noise_deg)),
        truth=mpf(1.0),
    )


def directions_of_axes() -> Trial:
    """Axes of turns: how far their coordinates are from uniform on [-1, 1] (Archimedes)."""

    def distance(noisy: PoseTable) -> float:
        before, after = (
            Rotation.from_quat(t.quat_wxyz, scalar_first=True) for t in (clean(), noisy)
        )
        vectors = (after * before.inv()).as_rotvec()
        unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
        found = [kstest(column, "uniform", (-1.0, 2.0), method="asymp") for column in unit.T]
        return max(float(result.statistic) for result in found)

    return Trial(
        naive=lambda: distance(_published_turns(20.0)),
        ours=lambda: distance(_noisy(0.0, 20.0)),
        truth=mpf(0.0),
    )
