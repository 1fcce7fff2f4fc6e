"""From which errors of the labels on regression is the better choice: one sentence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from synfeal.config import MODELS
from synfeal.report.layouts import scene_title

STRUCTURE = "structure-depth"
TRUE_M = "position_m_true"


def crossing_findings(table: pd.DataFrame) -> list[str]:
    """The findings of all scenes and sizes that have one."""
    blocks = [block for _, block in table.groupby(["scene", "size"], sort=False)]
    return [sentence for sentence in map(crossing_finding, blocks) if sentence]


def crossing_finding(table: pd.DataFrame) -> str:
    """Where structure-based poses stop being the better ones, from noise in both parts of a pose.

    Args:
        table: rows of ``references.csv`` of one scene and size.

    Returns:
        A sentence; empty where the design has no noise in both, or no structure.
    """
    both = table.labels.str.startswith("noise-") & (table.noise_m > 0) & (table.noise_deg > 0)
    noisy = table[both | (table.labels == "synfeal")]
    levels = noisy[["noise_m", "noise_deg"]].drop_duplicates().sort_values("noise_m")
    if len(levels) < 2 or not {STRUCTURE, *MODELS} <= set(noisy.method):
        return ""
    first, *later = [_level(noisy, *level) for level in levels.itertuples(index=False)]
    parts = [f"{level.better} of {level.localizers} {level.name}" for level in later]
    return (
        f"{scene_title(str(noisy.scene.iloc[0]))}, {noisy['size'].iloc[0]}: with exact labels"
        f" structure-based poses are off by {100 * first.structure_m:.2g} cm, the best localizer by"
        f" {100 * first.best_m:.2g} cm; with noise in the labels the localizers that are closer to"
        f" the truth than they are: {', '.join(parts)}."
    )


class _Level(NamedTuple):
    """One level of noise: localizers better than structure, of how many, and both errors."""

    name: str
    better: int
    localizers: int
    structure_m: float
    best_m: float


def _level(table: pd.DataFrame, noise_m: float, noise_deg: float) -> _Level:
    """Median position errors against the truth at a level; infinite where structure failed."""
    level = table[(table.noise_m == noise_m) & (table.noise_deg == noise_deg)]
    structure_m = float(level[level.method == STRUCTURE][TRUE_M].fillna(np.inf).iloc[0])
    localizers = level[level.method.isin(MODELS)][TRUE_M].fillna(np.inf)
    better = int((localizers < structure_m).sum())
    name = f"at {noise_m:g} m and {noise_deg:g}°"
    return _Level(name, better, len(localizers), structure_m, float(localizers.min()))
