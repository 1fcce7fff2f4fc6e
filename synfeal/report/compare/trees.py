"""Every run that two result trees share, compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.report.compare.runs import KEY, find_runs, read_run
from synfeal.report.compare.stats import compare_errors
from synfeal.report.results import read_result, unequal_leaves
from synfeal.report.stats import MEASURES

PROVENANCE = "provenance.json"
OUTCOMES = ("files", "stages", "time_utc")  # differ between any two runs; no reason for anything
Sameness = Literal["same", "differ", "unknown"]
# Trees of two machines may differ in the last digits of a pose; no picture shows that.
TOLERANCE = 1e-6
ORDER = (
    *(*KEY, "measure", "a", "b", "difference", "low", "high", "change_percent", "verdict"),
    *("sd_a", "sd_b", "se_seeds", "test_frames", "test_labels"),
    *(f"{count}_{tree}" for count in ("n_test", "n_paths", "n_seeds", "failed") for tree in "ab"),
)


@dataclass(frozen=True)
class Comparison:
    """Two trees side by side."""

    names: tuple[str, str]  # the directories as they were given
    # A row per run in both trees and measure. Columns are those of a run's directory, of
    # :func:`~synfeal.report.compare.stats.compare_errors`, ``test_frames`` and ``test_labels``,
    # which say whether both trees have the same, and counts of either.
    table: pd.DataFrame
    only: tuple[int, int]  # how many runs are in A only and in B only
    # Keys of the provenance of the trees that differ, with the value in each, NaN where one lacks
    # it; None where either has no provenance.
    changes: pd.DataFrame | None

    @property
    def runs(self) -> pd.DataFrame:
        """One row per run: what is said of all its measures."""
        return self.table[self.table["measure"] == MEASURES[0]]


def one_yardstick(run: pd.DataFrame) -> bool:
    """Whether the labels of a run are the true poses, so that both scores are the same numbers."""
    values = run.set_index("measure")[["a", "b", "low", "high", "sd_a", "sd_b"]]
    labels, truth = (values.loc[[f"{m}{end}" for m in MEASURES[:2]]] for end in ("", "_true"))
    return labels.reset_index(drop=True).equals(truth.reset_index(drop=True))


def compare_trees(root_a: Path, root_b: Path) -> Comparison:
    """Compare every run that is in both trees."""
    found_a, found_b = find_runs(root_a), find_runs(root_b)
    shared = [key for key in found_a if key in found_b]
    if not shared:
        raise InputError(
            f"{root_b}: has no run in common with {root_a} (of {len(found_b)} and {len(found_a)});"
            " compare trees of the same experiments"
        )

    @cache
    def poses(path: Path) -> PoseTable | None:
        return read_pose_table(path) if path.exists() else None

    def sameness(place: str, count: int) -> Sameness:
        return _sameness(poses(root_a / place), poses(root_b / place), count)

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
    """The differences of one run, and what both trees tested it on."""
    a, b = read_run(seeds_a), read_run(seeds_b)
    scene, size, labels, *_ = key
    plans, carried = f"plans/{scene}/test.csv", f"labels/{scene}/{size}/{labels}/test.csv"
    views = np.array_equal(a.frame, b.frame) and np.array_equal(a.path, b.path)
    frames: Sameness = sameness(plans, len(a.frame)) if views else "differ"
    alike = len(a.frame) == len(b.frame)
    counts = {f"{name}_a": count for name, count in a.counts().items()}
    counts |= {f"{name}_b": count for name, count in b.counts().items()}
    return compare_errors(a, b, paired=frames == "same").assign(
        **dict(zip(KEY, key, strict=True)),
        test_frames=frames,
        test_labels=sameness(carried, len(a.frame)) if alike else "differ",
        **counts,
    )


def _sameness(a: PoseTable | None, b: PoseTable | None, count: int) -> Sameness:
    """Whether the first ``count`` poses of two tables are the same."""
    if a is None or b is None:
        return "unknown"
    if min(len(a), len(b)) < count:
        return "differ"
    a_rows, b_rows = (
        np.column_stack([t.frame, t.path, t.position_m, t.quat_wxyz])[:count] for t in (a, b)
    )
    return "same" if np.allclose(a_rows, b_rows, rtol=0, atol=TOLERANCE) else "differ"


def _changes(path_a: Path, path_b: Path) -> pd.DataFrame | None:
    if not (path_a.exists() and path_b.exists()):
        return None
    records = (read_result(path, (), "delete it or run again") for path in (path_a, path_b))
    causes = ({k: v for k, v in record.items() if k not in OUTCOMES} for record in records)
    return unequal_leaves(*causes)
