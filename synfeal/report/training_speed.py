"""The rows of ``speed_vs_error.csv`` that say what training a localizer costs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from synfeal.errors import InputError
from synfeal.frames import COUNT, MAYBE, TEXT, frame_of, read_frame, rows_of
from synfeal.report.cost.measured import read_jobs
from synfeal.report.layouts import TITLES

# The table whose training runs are shown, and the part of their names that all of them share.
TABLE = "table4_size"
KIND = "synfeal/pretrained"
CELL = {
    **{"scene": TEXT, "size": TEXT, "model": TEXT, "n_train": COUNT, "n_seeds": COUNT},
    "position_m_true": MAYBE,
}


def training_rows(root: Path, scene: str) -> pd.DataFrame:
    """The localizers on the largest set of Table 4; an item is an image shown.

    The error is the median of positions against the true poses, in metres. The time is that of
    the processor in the whole job, over all seeds: starting up, reading frames, and predicting the
    test set are in it. Nothing is chosen: the paper compares the localizers. No rows where the
    design has no Table 4, and none for a localizer of which all seeds failed.
    """
    path = root / "tables" / f"{TABLE}.csv"
    cells = read_frame(path, CELL) if path.exists() else frame_of((), CELL)
    cells = cells[cells.scene == scene]
    cells = cells[cells.n_train == cells.n_train.max()].dropna(subset="position_m_true")
    runs = [_runs(cell) for cell in rows_of(cells)]
    seconds = _processor_seconds(root, [name for names in runs for name in names])
    return pd.DataFrame(
        {
            "variant": cells.model.map(TITLES),
            "seconds_per_item": [_seconds_per_image(root, names, seconds) for names in runs],
            "error": cells.position_m_true,
            "error_unit": "m",
            "chosen": 0,
        }
    )


def _seconds_per_image(root: Path, runs: Sequence[str], seconds: dict[str, float]) -> float:
    """Processor seconds over images shown, of all repetitions of a cell."""
    images = sum(_images_shown(root / "runs" / name / "history.csv") for name in runs)
    return sum(seconds[name] for name in runs) / images


def _runs(cell: Any) -> list[str]:
    """Directories of a cell's training runs, below ``runs``."""
    stem = f"{cell.scene}/{cell.size}/{KIND}/{cell.model}"
    return [f"{stem}/seed{repetition}" for repetition in range(cell.n_seeds)]


def _processor_seconds(root: Path, runs: Sequence[str]) -> dict[str, float]:
    """Processor seconds by run; no other jobs are looked at, for the rule names no others."""
    folder = root / "benchmarks"
    paths = {name: folder / "train" / f"{name}.tsv" for name in runs}
    measured = read_jobs([path for path in paths.values() if path.exists()], folder)
    seconds = dict(zip(measured["job"], measured["cpu_s"], strict=True))
    for name, path in paths.items():
        if not seconds.get(name, 0.0) > 0.0:
            raise InputError(f"{path}: missing, or measured no time; train it again")
    return seconds


def _images_shown(history: Path) -> float:
    shown = read_frame(history, {"samples_seen": COUNT}, "train it again").samples_seen
    if shown.empty or shown.iloc[-1] <= 0:
        raise InputError(f"{history}: shows no images; train it again")
    return float(shown.iloc[-1])
