"""The rows of ``speed_vs_error.csv`` that say what training a localizer costs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from synfeal.errors import InputError
from synfeal.report.cost.measured import read_jobs
from synfeal.report.layouts import TITLES
from synfeal.report.results import read_table
from synfeal.report.tables import Value

# The table whose training runs are shown, and the part of their names that all of them share.
TABLE = "table4_size"
KIND = "synfeal/pretrained"


def training_rows(root: Path, scene: str) -> list[dict[str, Value]]:
    """The localizers on the largest set of Table 4; an item is an image shown.

    The error is the median of positions against the true poses, in metres. The time is that of
    the processor in the whole job, over all seeds: starting up, reading frames, and predicting the
    test set are in it. Nothing is chosen: the paper compares the localizers. No rows where the
    design has no Table 4, and none for a localizer of which all seeds failed.

    Raises:
        InputError: the table, the history of a training run or its measurement cannot be read.
    """
    path = root / "tables" / f"{TABLE}.csv"
    if not path.exists():
        return []
    numbers = ("n_train", "n_seeds")
    table = read_table(path, ("scene", "size", "model"), numbers, ("position_m_true",))
    rows = [row for row in table if row["scene"] == scene]
    largest = max((float(row["n_train"]) for row in rows), default=0.0)
    shown = [row for row in rows if float(row["n_train"]) == largest and row["position_m_true"]]
    if not shown:
        return []
    seconds = _processor_seconds(root, [name for row in shown for name in _runs(row)])
    return [_row(row, _seconds_per_image(root, row, seconds)) for row in shown]


def _row(row: dict[str, str], seconds_per_image: float) -> dict[str, Value]:
    return {
        "stage": "training",
        "scene": row["scene"],
        "variant": TITLES[row["model"]],
        "seconds_per_item": seconds_per_image,
        "items_per_s": 1.0 / seconds_per_image,
        "error": float(row["position_m_true"]),
        "error_unit": "m",
        "chosen": 0,
    }


def _seconds_per_image(root: Path, row: dict[str, str], seconds: dict[str, float]) -> float:
    """Processor seconds over images shown, of all seeds."""
    images = sum(_images_shown(root / "runs" / name / "history.csv") for name in _runs(row))
    return sum(seconds[name] for name in _runs(row)) / images


def _runs(row: dict[str, str]) -> list[str]:
    """Directories of a cell's training runs, below ``runs``."""
    stem = f"{row['scene']}/{row['size']}/{KIND}/{row['model']}"
    return [f"{stem}/seed{repetition}" for repetition in range(int(float(row["n_seeds"])))]


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
    rows = read_table(history, ("samples_seen",), ("samples_seen",))
    if not rows or float(rows[-1]["samples_seen"]) <= 0.0:
        raise InputError(f"{history}: shows no images; train it again")
    return float(rows[-1]["samples_seen"])
