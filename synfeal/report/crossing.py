"""From which errors of the labels on regression is the better choice: one sentence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from synfeal.config import MODELS
from synfeal.report.layouts import scene_title

STRUCTURE, ADJUSTED = "structure-depth", "structure-adjusted"
TRUE = ("position_m_true", "orientation_deg_true")


def crossing_findings(table: pd.DataFrame) -> list[str]:
    """The findings of all scenes and sizes that have one."""
    blocks = [block for _, block in table.groupby(["scene", "size"], sort=False)]
    return [sentence for sentence in map(crossing_finding, blocks) if sentence]


def crossing_finding(table: pd.DataFrame) -> str:
    """Where structure-based poses stop being the better ones, from noise in both parts of a pose.

    A sentence on the rows of ``references.csv`` of one scene and size; empty where the design has
    no noise in both, or no structure.
    """
    both = table.labels.str.startswith("noise-") & (table.noise_m > 0) & (table.noise_deg > 0)
    noisy = table[both | (table.labels == "synfeal")]
    levels = noisy[["noise_m", "noise_deg"]].drop_duplicates().sort_values("noise_m")
    if len(levels) < 2 or not {STRUCTURE, *MODELS} <= set(noisy.method):
        return ""
    first, *later = [_level(noisy, *level) for level in levels.itertuples(index=False)]
    parts = [
        "{} in position and {} in orientation {}".format(*level.better, level.name)
        for level in later
    ]
    structure_m, structure_deg = first.structure
    best_m, best_deg = first.best
    return (
        f"{scene_title(str(noisy.scene.iloc[0]))}, {noisy['size'].iloc[0]}: with exact labels"
        f" structure-based poses are off by {100 * structure_m:.2g} cm and {structure_deg:.2g}°,"
        f" the best localizer by {100 * best_m:.2g} cm and {best_deg:.2g}°; of the {len(MODELS)}"
        f" localizers are closer to the truth than structure on the same noisy labels"
        f" {', '.join(parts)}.{_adjusted(noisy, *levels.iloc[-1])}"
    )


def _adjusted(table: pd.DataFrame, noise_m: float, noise_deg: float) -> str:
    """What bundle adjustment of the map makes of a level; empty where it was not asked."""
    level = table[(table.noise_m == noise_m) & (table.noise_deg == noise_deg)]
    found = level.loc[level.method == ADJUSTED, list(TRUE)].dropna()
    if found.empty:
        return ""
    off_m, off_deg = found.iloc[0]
    return (
        f" On a map that was bundle-adjusted from labels with {noise_m:g} m and {noise_deg:g}°,"
        f" structure-based poses are off by {100 * off_m:.2g} cm and {off_deg:.2g}°."
    )


class _Level(NamedTuple):
    """One level of noise: position (m) and orientation (degrees) of structure, of the best."""

    name: str
    better: tuple[int, int]
    structure: tuple[float, float]
    best: tuple[float, float]


def _level(table: pd.DataFrame, noise_m: float, noise_deg: float) -> _Level:
    """Median errors against the truth at a level; infinite where structure failed."""
    level = table[(table.noise_m == noise_m) & (table.noise_deg == noise_deg)]
    errors = level.set_index("method")[list(TRUE)].fillna(np.inf)
    structure = errors.loc[[STRUCTURE]].to_numpy(dtype=float)[0]
    localizers = errors.loc[list(MODELS)].to_numpy(dtype=float)
    better, best = (localizers < structure).sum(axis=0), localizers.min(axis=0)
    return _Level(
        f"at {noise_m:g} m and {noise_deg:g}°",
        (int(better[0]), int(better[1])),
        (float(structure[0]), float(structure[1])),
        (float(best[0]), float(best[1])),
    )
