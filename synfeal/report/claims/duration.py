"""Section 4.4: how long a training run takes, by a stopping rule on held-out paths.

The length of a run is set, so the time it takes says nothing. What a history tells is when a run
reached a level: a run from scratch is stopped at its lowest error on held-out training paths, and
the run with transfer learning beside it where it first is as low. The error is the product of the
median position and orientation errors, by which weights are chosen. Images shown stand for time: of
two runs of one localizer they cost the same. Where transfer learning never gets there all its
images count, which is fewer than it would need.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from synfeal.bootstrap import Array, limits
from synfeal.config import MODELS
from synfeal.errors import InputError, why
from synfeal.report.claims.evidence import Cell, Evidence
from synfeal.report.claims.model import Claim, Missing, Outcome
from synfeal.report.claims.size import SIZES
from synfeal.report.claims.verdicts import Condition, all_of
from synfeal.seeds import generator_of

SCENE = "large_room"
RESAMPLES = 4000
FEWEST_RUNS = 2
HELD_OUT = ["held_out_position_m", "held_out_orientation_deg"]


def longer(claim: Claim, evidence: Evidence) -> Outcome:
    """C13: from scratch, more images are shown until one and the same held-out error is reached."""
    ratios = [r for size in SIZES[SCENE] for m in MODELS for r in _ratios(evidence, m, size)]
    if len(ratios) < FEWEST_RUNS:
        raise Missing("no held-out errors in the histories (training.validation_share is 0)")
    change = resampled_change(ratios)
    low, high = limits(change)
    verdict, reason = all_of([Condition("images shown", change, claim.numbers[0])])
    text = f"{change[0]:+.0f} % images, {len(ratios)} pairs of training runs"
    return Outcome(verdict, text, f"{low:+.0f} to {high:+.0f} %", reason)


def resampled_change(ratios: Sequence[float]) -> Array:
    """Geometric mean of ratios as a change in percent: observed, and with the pairs resampled."""
    logs = np.log(ratios)
    rng = generator_of("claims", "duration")
    drawn = logs[rng.integers(len(logs), size=(RESAMPLES, len(logs)))].mean(axis=1)
    return np.asarray(100 * np.expm1(np.concatenate([[logs.mean()], drawn])))


def images_until(history: pd.DataFrame, level: float) -> float:
    """Images shown when the held-out error first is at or below a level; all where it never is."""
    reached = history.loc[history["error"] <= level, "samples_seen"]
    return float(reached.iloc[0] if len(reached) else history["samples_seen"].iloc[-1])


def _ratios(evidence: Evidence, model: str, size: str) -> list[float]:
    """Images from scratch over images with transfer learning, repetition by repetition."""
    scratch = Cell(model, SCENE, size, init="scratch")
    runs = [evidence.runs_of(cell) for cell in (scratch, scratch._replace(init="pretrained"))]
    ratios = []
    for pair in zip(*runs, strict=False):
        own, other = (
            read_history(evidence.file(f"runs/{run.directory}/history.csv")) for run in pair
        )
        if len(own) and len(other):
            level = float(own["error"].min())
            ratios.append(images_until(own, level) / images_until(other, level))
    return ratios


def read_history(path: Path) -> pd.DataFrame:
    """Columns ``samples_seen`` and ``error``, the product of the held-out medians (m deg).

    Raises:
        InputError: it cannot be read or lacks a column.
    """
    try:
        table = pd.read_csv(path, usecols=["samples_seen", *HELD_OUT], dtype=float)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path}: cannot be read as a history ({why(error)}); train it again"
        ) from None
    table["error"] = table[HELD_OUT].prod(axis=1, skipna=False)
    return table.dropna()[["samples_seen", "error"]]
