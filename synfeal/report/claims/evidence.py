"""What a run left behind, as the tests of the claims need it: a median error per cell, resampled.

Only cells of the profile's design are used, so that files of an earlier design in the same place
decide nothing. What is not there ends in :class:`Missing`; what is there and cannot be read ends in
an ``InputError``, as everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from synfeal.bootstrap import Array, Counts, mean_of, medians, path_counts
from synfeal.config import Design, Run
from synfeal.dataset.number_table import read_numbers
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.report.claims.model import Missing
from synfeal.report.stats import MEASURES
from synfeal.seeds import generator_of

HEADER = ",".join(("frame", *MEASURES))


class Cell(NamedTuple):
    """One trained localizer, whatever tables show it; the defaults are those of Table 2."""

    model: str
    scene: str = "large_room"
    size: str = "6k"
    labels: str = "synfeal"
    init: str = "pretrained"


class Errors(NamedTuple):
    """Samples of the two median errors of a cell: metres and degrees."""

    position: Array
    orientation: Array


@dataclass(frozen=True)
class Evidence:
    """A results directory, read under one of the two scores.

    Attributes:
        root: results directory of the profile.
        runs: by cell of the profile, its runs; their median errors are averaged.
        end: ``""`` for errors against the labels, ``"_true"`` against the true poses.
        used: files read so far, relative to ``root``.
        test_paths: by test set, how many paths it has.
    """

    root: Path
    runs: Mapping[Cell, Sequence[Run]]
    end: str = ""
    used: dict[str, None] = field(default_factory=dict)
    test_paths: dict[tuple[str, str], int] = field(default_factory=dict)
    _errors: dict[tuple[Cell, str], Errors] = field(default_factory=dict)
    _tests: dict[tuple[str, str], tuple[PoseTable, Counts]] = field(default_factory=dict)

    def under(self, end: str) -> Evidence:
        """The same results under a score, with nothing read yet."""
        return replace(self, end=end, used={}, test_paths={})

    def file(self, relative: str) -> Path:
        """A result file, noted as used.

        Raises:
            Missing: there is no such file.
        """
        path = self.root / relative
        if not path.is_file():
            raise Missing(f"{relative} is missing")
        self.used[relative] = None
        return path

    def errors(self, cell: Cell) -> Errors:
        """Median errors of a cell, observed and resampled, averaged over its repetitions.

        Raises:
            Missing: the profile does not run the cell, or a file of it is missing.
            InputError: a file cannot be read, or is about other frames.
        """
        if cell not in self.runs:
            raise Missing(f"this profile has no row {_name(cell)}")
        table, counts = self._test_set(cell)
        self.test_paths[cell.scene, cell.size] = counts.shape[1]
        files = [self.file(f"runs/{run.directory}/errors.csv") for run in self.runs[cell]]
        if (cell, self.end) not in self._errors:
            path = np.unique(table.path, return_inverse=True)[1]
            runs = [_read_errors(file, table) for file in files]
            columns = [HEADER.split(",").index(m + self.end) for m in MEASURES[:2]]
            means = [mean_of([medians(run[:, c], path, counts) for run in runs]) for c in columns]
            self._errors[cell, self.end] = Errors(*means)
        return self._errors[cell, self.end]

    def _test_set(self, cell: Cell) -> tuple[PoseTable, Counts]:
        """Frames of a test set, and how often each resample draws their paths."""
        path = self.file(f"labels/{cell.scene}/{cell.size}/synfeal/test.csv")
        key = cell.scene, cell.size
        if key not in self._tests:
            table = read_pose_table(path)
            rng = generator_of("claims", *key)
            self._tests[key] = table, path_counts(len(np.unique(table.path)), rng)
        return self._tests[key]


def evidence_of(design: Design, root: Path) -> Evidence:
    """The results of a profile.

    Args:
        design: of the profile.
        root: its results directory.
    """
    runs: dict[Cell, list[Run]] = {}
    for run in design.runs:
        cell = Cell(run.model, run.scene, run.size, run.labels, run.init)
        runs.setdefault(cell, []).append(run)
    return Evidence(root, runs)


def _name(cell: Cell) -> str:
    return f"{cell.scene} {cell.size} {cell.labels} {cell.init}"


def _read_errors(path: Path, table: PoseTable) -> Array:
    """Columns of ``HEADER`` of one run (N, 5), about the frames of a test set."""
    values = read_numbers(path, HEADER, "table of errors", finite=False)
    if not np.array_equal(values[:, 0], table.frame):
        raise InputError(f"{path}: its frames are not those of the test set; score that run again")
    return values
