"""Every run that two result trees share, compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reproduction.compare.stats import Array, RunErrors, compare_errors
from reproduction.runs.results import read_result, unequal_leaves
from reproduction.statistics.limits import MEASURES, REMEDY, read_errors, read_metrics, sign_test
from synfeal.dataset.pose_table import HEADER, read_pose_table, whole_numbers
from synfeal.errors import InputError
from synfeal.records.tables import read_numbers

# What a run is, apart from its seed: the directories below ``runs``, in order.
KEY = ("scene", "size", "labels", "init", "model")
PROVENANCE = "provenance.json"
OUTCOMES = ("files", "stages", "time_utc")  # differ between any two runs; no reason for anything
Sameness = Literal["same", "differ", "unknown"]
# Trees of two machines may differ in the last digits of a pose; no picture shows that.
TOLERANCE = 1e-6
# Of runs, by what their intervals say.
VERDICTS = {"better": "better", "worse": "worse", "unseen": "no difference seen"}
ORDER = (
    *KEY,
    "measure",
    "a",
    "b",
    "difference",
    "low",
    "high",
    "change_percent",
    "verdict",
    "sd_a",
    "sd_b",
    "test_frames",
    "test_labels",
    *(f"{count}_{tree}" for count in ("n_test", "n_paths", "n_seeds", "failed") for tree in "ab"),
)


@dataclass(frozen=True)
class Comparison:
    """Two trees side by side."""

    names: tuple[str, str]  # the directories as they were given
    # A row per run in both trees and measure. Columns are those of a run's directory, of
    # :func:`~reproduction.compare.stats.compare_errors`, ``test_frames`` and ``test_labels``,
    # which say whether both trees have the same, and counts of either.
    table: pd.DataFrame
    only: tuple[int, int]  # how many runs are in A only and in B only
    # Keys of the provenance of the trees that differ, with the value in each, NaN where one lacks
    # it; None where either has no provenance.
    changes: pd.DataFrame | None

    @property
    def runs(self) -> pd.DataFrame:
        """One row per run, with what its measures have in common."""
        return self.table[self.table["measure"] == MEASURES[0]]


def one_yardstick(run: pd.DataFrame) -> bool:
    """Tell whether a run's labels are the true poses, so that both scores agree."""
    # Not their limits: for each measure a single run borrows a deviation of its own.
    values = run.set_index("measure")[["a", "b", "sd_a", "sd_b"]]
    labels, truth = (values.loc[[f"{m}{end}" for m in MEASURES[:2]]] for end in ("", "_true"))
    return labels.reset_index(drop=True).equals(truth.reset_index(drop=True))


def summary_of(table: pd.DataFrame) -> pd.DataFrame:
    """Count by measure how many runs are ``better``, ``worse`` or ``unseen`` by their intervals.

    Also count how many are ``lower`` or ``higher``, by however little, with ``p_sign`` of a
    two-sided sign test of these (1 without either), and average ``percent``, the relative change.
    """
    rows = []
    for measure, found in table.groupby("measure", sort=False):
        counts = {name: (found["verdict"] == verdict).sum() for name, verdict in VERDICTS.items()}
        lower, signed, p_sign = sign_test(found["difference"].tolist())
        signs = {"lower": lower, "higher": signed - lower, "p_sign": p_sign}
        percent = found["change_percent"].mean()
        rows.append({"measure": measure, **counts, **signs, "percent": percent})
    return pd.DataFrame(rows)


def groups_of(table: pd.DataFrame) -> pd.DataFrame:
    """Average relative changes by scene, label source and model, in order of appearance.

    Columns are ``grouping``, ``name``, ``n_runs``, and a mean for each measure, infinite where a
    run of the group failed in B only.
    """
    parts = []
    for grouping in ("scene", "labels", "model"):
        groups = table.groupby([grouping, "measure"], sort=False)["change_percent"]
        means = groups.mean().unstack("measure", sort=False)[list(MEASURES)]
        means.insert(0, "n_runs", groups.size().unstack("measure")[MEASURES[0]])
        parts.append(means.rename_axis("name").reset_index().assign(grouping=grouping))
    return pd.concat(parts, ignore_index=True)[["grouping", "name", "n_runs", *MEASURES]]


def compare_trees(root_a: Path, root_b: Path) -> Comparison:
    """Compare every run that is in both trees.

    Raises:
        InputError: The trees have no run in common.
    """
    found_a, found_b = find_runs(root_a), find_runs(root_b)
    shared = [key for key in found_a if key in found_b]
    if not shared:
        raise InputError(
            root_b,
            f"has no run in common with {root_a} (of {len(found_b)} and {len(found_a)})",
            "compare trees of the same experiments",
        )

    @cache
    def sameness(place: str, count: int) -> Sameness:
        return _sameness(root_a / place, root_b / place, count)

    runs = [_compare_run(key, found_a[key], found_b[key], sameness) for key in shared]
    return Comparison(
        names=(str(root_a), str(root_b)),
        table=pd.concat(runs, ignore_index=True)[list(ORDER)],
        only=(len(found_a) - len(shared), len(found_b) - len(shared)),
        changes=_changes(root_a / PROVENANCE, root_b / PROVENANCE),
    )


def _compare_run(
    key: tuple[str, ...],
    seeds_a: list[Path],
    seeds_b: list[Path],
    sameness: Callable[[str, int], Sameness],
) -> pd.DataFrame:
    """Compare one run, and record what both trees tested it on."""
    a, b = read_run(seeds_a), read_run(seeds_b)
    scene, size, labels, _, model = key
    plans, carried = f"plans/{scene}/test.csv", f"labels/{scene}/{size}/{labels}/test.csv"
    views = np.array_equal(a.frame, b.frame) and np.array_equal(a.path, b.path)
    frames: Sameness = sameness(plans, len(a.frame)) if views else "differ"
    alike = len(a.frame) == len(b.frame)
    counts = {f"{name}_a": count for name, count in a.counts().items()}
    counts |= {f"{name}_b": count for name, count in b.counts().items()}
    return compare_errors(a, b, frames == "same", model).assign(
        **dict(zip(KEY, key, strict=True)),
        test_frames=frames,
        test_labels=sameness(carried, len(a.frame)) if alike else "differ",
        **counts,
    )


def _sameness(path_a: Path, path_b: Path, count: int) -> Sameness:
    """Tell whether the first ``count`` poses of two tables are the same."""
    if not (path_a.exists() and path_b.exists()):
        return "unknown"
    tables = read_pose_table(path_a), read_pose_table(path_b)
    if min(map(len, tables)) < count:
        return "differ"
    a_rows, b_rows = (
        np.column_stack([t.frame, t.path, t.position_m, t.quat_wxyz])[:count] for t in tables
    )
    return "same" if np.allclose(a_rows, b_rows, rtol=0, atol=TOLERANCE) else "differ"


def _changes(path_a: Path, path_b: Path) -> pd.DataFrame | None:
    if not (path_a.exists() and path_b.exists()):
        return None
    records = (read_result(path, (), "delete it or run again") for path in (path_a, path_b))
    causes = ({k: v for k, v in record.items() if k not in OUTCOMES} for record in records)
    return unequal_leaves(*causes)


def find_runs(root: Path) -> dict[tuple[str, ...], list[Path]]:
    """Find every scored training run of a results tree.

    Args:
        root: Results of a profile, such as ``results/mini``.

    Returns:
        The directories of the seeds of each run, in order of name, by what the run is (``KEY``):
        scene, size, labels, init and model.

    Raises:
        InputError: There is no scored run.
    """
    found: dict[tuple[str, ...], list[Path]] = {}
    for path in sorted(root.glob("runs/*/*/*/*/*/seed*/metrics.json")):
        key = path.parent.relative_to(root / "runs").parts[:-1]
        found.setdefault(key, []).append(path.parent)
    if not found:
        raise InputError(
            root,
            "not a results tree",
            "name a directory that holds"
            " runs/<scene>/<size>/<labels>/<init>/<model>/seed<k>/metrics.json",
        )
    return found


def read_run(seeds: Sequence[Path]) -> RunErrors:
    """Read the errors of a run from the directories of its seeds.

    Raises:
        InputError: Seeds were tested on different frames.
    """
    index = [_read_index(seed) for seed in seeds]
    for seed, found in zip(seeds, index, strict=True):
        if not np.array_equal(found, index[0]):
            raise InputError(seed, f"was tested on other frames than {seeds[0]}", "run both again")
    frame, path = index[0].T
    return RunErrors(frame, path, np.stack([_read_seed(seed, frame) for seed in seeds]))


def _read_index(seed: Path) -> NDArray[np.int64]:
    """Read frame and path (N, 2) of the predictions."""
    path = seed / "predictions.csv"
    values = read_numbers(path, HEADER, "table of predictions", finite=False)[:, :2]
    if not len(values):
        raise InputError(path, "has no rows", "predict again")
    return whole_numbers(values, path)


def _read_seed(seed: Path, frame: NDArray[np.int64]) -> Array:
    """Read the errors (4, N) of one seed, which its scores are the medians of."""
    path = seed / "errors.csv"
    table = read_errors(path)
    if not np.array_equal(table["frame"], frame):
        raise InputError(path, "its frames are not those of predictions.csv", REMEDY)
    errors = table[list(MEASURES)].to_numpy().T
    if (errors < 0).any():
        raise InputError(path, "holds an error below zero", REMEDY)
    errors = np.where(np.isnan(errors), np.inf, errors)
    path = seed / "metrics.json"
    metrics = read_metrics(path)
    for measure, median in zip(MEASURES, np.median(errors, axis=1), strict=True):
        noted = math.inf if metrics[measure] is None else metrics[measure]
        if not math.isclose(noted, median, rel_tol=1e-6):
            raise InputError(
                path,
                f"{measure} is {metrics[measure]}, the median of errors.csv {median:.6g}",
                REMEDY,
            )
    return errors
