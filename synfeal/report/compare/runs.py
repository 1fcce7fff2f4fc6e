"""The runs of a result tree, and the errors of every test frame of one run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import HEADER, whole_numbers
from synfeal.errors import InputError
from synfeal.frames import read_numbers
from synfeal.report.stats import MEASURES, REMEDY, read_errors, read_metrics

# What a run is, apart from its seed: the directories below ``runs``, in order.
KEY = ("scene", "size", "labels", "init", "model")
RunKey = tuple[str, ...]


@dataclass(frozen=True)
class RunErrors:
    """The errors of one run over its test frames."""

    frame: NDArray[np.int64]  # (N,) index in the test split
    path: NDArray[np.int64]  # (N,) index of the straight path the frame belongs to
    # (seeds, 4, N) by :data:`~synfeal.report.stats.MEASURES`; a prediction that was not finite has
    # infinite errors.
    errors: NDArray[np.float64]

    def counts(self) -> dict[str, int]:
        """Test frames, the paths these belong to, seeds, and predictions that were not finite."""
        paths, seeds = len(np.unique(self.path)), len(self.errors)
        failed = int(np.isinf(self.errors[:, 0]).sum())
        return {"n_test": len(self.frame), "n_paths": paths, "n_seeds": seeds, "failed": failed}


def find_runs(root: Path) -> dict[RunKey, list[Path]]:
    """The directories of all seeds of every scored run of a tree, in the order of their names."""
    found: dict[RunKey, list[Path]] = {}
    for path in sorted(root.glob("runs/*/*/*/*/*/seed*/metrics.json")):
        key = path.parent.relative_to(root / "runs").parts[:-1]
        found.setdefault(key, []).append(path.parent)
    if not found:
        raise InputError(
            f"{root}: not a results tree; name a directory that holds"
            " runs/<scene>/<size>/<labels>/<init>/<model>/seed<k>/metrics.json"
        )
    return found


def read_run(seeds: Sequence[Path]) -> RunErrors:
    """The errors of a run from the directories of its seeds."""
    index = [_read_index(seed) for seed in seeds]
    for seed, found in zip(seeds, index, strict=True):
        if not np.array_equal(found, index[0]):
            raise InputError(f"{seed}: was tested on other frames than {seeds[0]}; run both again")
    errors = np.stack([_read_seed(seed, index[0][:, 0]) for seed in seeds])
    return RunErrors(index[0][:, 0], index[0][:, 1], errors)


def _read_index(seed: Path) -> NDArray[np.int64]:
    """Frame and path (N, 2) of the predictions."""
    path = seed / "predictions.csv"
    values = read_numbers(path, HEADER, "table of predictions", finite=False)[:, :2]
    if not len(values):
        raise InputError(f"{path}: has no rows; predict again")
    return whole_numbers(values, path)


def _read_seed(seed: Path, frame: NDArray[np.int64]) -> NDArray[np.float64]:
    """Errors (4, N) of one seed."""
    path = seed / "errors.csv"
    table = read_errors(path)
    if not np.array_equal(table["frame"], frame):
        raise InputError(f"{path}: its frames are not those of predictions.csv; {REMEDY}")
    errors = table[list(MEASURES)].to_numpy().T
    if (errors < 0).any():
        raise InputError(f"{path}: holds an error below zero; {REMEDY}")
    errors = np.where(np.isnan(errors), np.inf, errors)
    _check_metrics(seed / "metrics.json", read_metrics(seed / "metrics.json"), errors)
    return errors


def _check_metrics(path: Path, metrics: Mapping[str, Any], errors: NDArray[np.float64]) -> None:
    """Refuse a pair of files that stem from different scorings."""
    for measure, values in zip(MEASURES, errors, strict=True):
        median = float(np.median(values))
        noted = math.inf if metrics[measure] is None else metrics[measure]
        if not isinstance(noted, int | float) or not math.isclose(noted, median, rel_tol=1e-6):
            raise InputError(
                f"{path}: {measure} is {metrics[measure]}, the median of errors.csv {median:.6g};"
                f" {REMEDY}"
            )
