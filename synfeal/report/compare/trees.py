"""Every run that two result trees share, compared."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from synfeal.bootstrap import FEWEST_PATHS
from synfeal.errors import InputError
from synfeal.report.compare.frames import FrameComparer, Sameness
from synfeal.report.compare.runs import RunErrors, RunKey, find_runs, read_run
from synfeal.report.compare.stats import Difference, compare_errors
from synfeal.report.results import read_result

PROVENANCE = "provenance.json"
OUTCOMES = ("files", "stages", "time_utc")  # differ between any two runs; no reason for anything


@dataclass(frozen=True)
class RunComparison:
    """One run in both trees; pairs are of tree A and tree B.

    Attributes:
        key: what was run.
        differences: by measure (:data:`~synfeal.report.stats.MEASURES`).
        plans: whether both saw the same test frames; only then are frames paired.
        labels: whether the test sets carry the same labels.
        n_test: test frames.
        n_paths: straight paths these belong to.
        n_seeds: repetitions.
        failed: predictions that were not finite, over all seeds.
    """

    key: RunKey
    differences: dict[str, Difference]
    plans: Sameness
    labels: Sameness
    n_test: tuple[int, int]
    n_paths: tuple[int, int]
    n_seeds: tuple[int, int]
    failed: tuple[int, int]

    @property
    def paired(self) -> bool:
        """Whether the intervals are of paired frames."""
        return self.plans == "same"

    @property
    def few_paths(self) -> bool:
        """Whether the test set has too few paths for a bootstrap over them."""
        return min(self.n_paths) < FEWEST_PATHS

    @property
    def one_yardstick(self) -> bool:
        """Whether the labels are the true poses, so that both scores are the same numbers."""
        d = self.differences
        return all(d[m] == d[f"{m}_true"] for m in ("position_m", "orientation_deg"))


@dataclass(frozen=True)
class ConfigChange:
    """A key of ``provenance.json`` whose values differ; None where a tree lacks it."""

    key: str
    a: str | None
    b: str | None


@dataclass(frozen=True)
class Comparison:
    """Two trees side by side.

    Attributes:
        names: the directories as they were given.
        runs: those in both trees.
        only: how many runs are in A only and in B only.
        changes: what differs between the provenance of the trees; None where either has none.
    """

    names: tuple[str, str]
    runs: tuple[RunComparison, ...]
    only: tuple[int, int]
    changes: tuple[ConfigChange, ...] | None


def compare_trees(root_a: Path, root_b: Path) -> Comparison:
    """Compare every run that is in both trees.

    Raises:
        InputError: a directory is no results tree, they share no run, or a file is broken.
    """
    found_a, found_b = find_runs(root_a), find_runs(root_b)
    shared = [key for key in found_a if key in found_b]
    if not shared:
        raise InputError(
            f"{root_b}: has no run in common with {root_a} (of {len(found_b)} and {len(found_a)});"
            " compare trees of the same experiments"
        )
    frames = FrameComparer(root_a, root_b)
    runs = [_compare_run(key, found_a[key], found_b[key], frames) for key in shared]
    return Comparison(
        names=(str(root_a), str(root_b)),
        runs=tuple(runs),
        only=(len(found_a) - len(shared), len(found_b) - len(shared)),
        changes=_changes(root_a / PROVENANCE, root_b / PROVENANCE),
    )


def _compare_run(
    key: RunKey, seeds_a: list[Path], seeds_b: list[Path], frames: FrameComparer
) -> RunComparison:
    a, b = read_run(seeds_a), read_run(seeds_b)
    plans = frames.plans(key, a, b)
    return RunComparison(
        key=key,
        differences=compare_errors(a, b, paired=plans == "same"),
        plans=plans,
        labels=frames.labels(key, a, b),
        n_test=(len(a.frame), len(b.frame)),
        n_paths=(_n_paths(a), _n_paths(b)),
        n_seeds=(len(seeds_a), len(seeds_b)),
        failed=(a.failed, b.failed),
    )


def _n_paths(run: RunErrors) -> int:
    return len(np.unique(run.path))


def _changes(path_a: Path, path_b: Path) -> tuple[ConfigChange, ...] | None:
    if not (path_a.exists() and path_b.exists()):
        return None
    a, b = (_flat(_causes(path)) for path in (path_a, path_b))
    keys = [key for key in sorted({*a, *b}) if a.get(key) != b.get(key)]
    return tuple(ConfigChange(key, a.get(key), b.get(key)) for key in keys)


def _causes(path: Path) -> dict[str, Any]:
    """What a run was made from, without what came out of it."""
    record = read_result(path, (), "delete it or run again")
    return {key: value for key, value in record.items() if key not in OUTCOMES}


def _flat(values: dict[str, Any], prefix: str = "") -> dict[str, str]:
    """Leaves of nested mappings as JSON, by their dotted keys."""
    flat: dict[str, str] = {}
    for key, value in values.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = json.dumps(value)
    return flat
