"""What a run left behind, as the tests of the claims need it: a median error per cell, resampled.

Errors are read on one of two test sets. A cell's *own* is what the tables show, labelled by the
cell's method. The *common* one of a scene has frames from all paths of its largest test set, the
same for every cell, and true poses: many more paths than small sizes have, and sizes compared on
the same frames.

Only what the profile's design makes is read, so that files of an earlier design in the same place
decide nothing. What the design does not make ends in :class:`Missing`; a file that it makes and
that is not there, or cannot be read, ends in an ``InputError``, as everywhere.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from synfeal.bootstrap import Array, Counts, limits, medians, over_seeds, path_counts, seed_weights
from synfeal.config import Design, Run
from synfeal.config.experiments import common_every
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.evaluation.metrics import pose_errors
from synfeal.labels import constant_pose
from synfeal.provenance import generator_of
from synfeal.report.claims.verdicts import Missing
from synfeal.report.layouts import TITLES
from synfeal.report.stats import COLUMNS, COMMON_COLUMNS, MEASURES, REMEDY, read_errors

# A localizer has learnt where its whole interval lies below this share of the mean pose's error.
LEARNT = 0.75
# Errors of a cell are two samples (2, 1 + RESAMPLES) of medians: metres and degrees.
QUANTITIES = ("position", "orientation")
# File, its columns and the two errors of each score; on the common test set both are against truth.
COMMON = "common"
SCORES = {
    "labels": ("errors.csv", COLUMNS, MEASURES[:2]),
    "true": ("errors.csv", COLUMNS, MEASURES[2:]),
    COMMON: ("common_errors.csv", COMMON_COLUMNS, MEASURES[:2]),
}


class Cell(NamedTuple):
    """One trained localizer, whatever tables show it; the defaults are those of Table 2."""

    model: str
    scene: str = "large_room"
    size: str = "6k"
    labels: str = "synfeal"
    init: str = "pretrained"


class TestSet(NamedTuple):
    """The true poses of a test set, which resample draws which paths, and what is no learning."""

    poses: PoseTable
    path: Counts
    counts: Counts
    constant: Array


@dataclass(frozen=True)
class Evidence:
    """A results directory, read under one score."""

    root: Path  # results directory of the profile
    runs: Mapping[Cell, Sequence[Run]]  # by cell of the profile, its runs
    # Scene, size and labels of its re-estimated label sets.
    estimated: Sequence[tuple[str, str, str]] = ()
    score: str = "labels"  # of ``SCORES``
    used: dict[str, None] = field(default_factory=dict)  # files read so far, relative to ``root``
    # By test set, how many paths it has.
    test_paths: dict[tuple[str, str, bool], int] = field(default_factory=dict)
    _errors: dict[tuple[Cell, str], Array] = field(default_factory=dict)
    _tests: dict[tuple[str, str, bool], TestSet] = field(default_factory=dict)

    def under(self, score: str) -> Evidence:
        """The same results under a score, with nothing read yet."""
        return replace(self, score=score, used={}, test_paths={})

    def file(self, relative: str) -> Path:
        """A result file that the design makes, noted as used."""
        path = self.root / relative
        if not path.is_file():
            raise InputError(f"{path}: missing; make the results again")
        self.used[relative] = None
        return path

    def need(self, **keys: str) -> None:
        """Make sure that the profile has cells with some values."""
        if not any(all(getattr(c, k) == v for k, v in keys.items()) for c in self.runs):
            raise Missing(f"this profile has no row {' '.join(keys.values())}")

    def runs_of(self, cell: Cell) -> Sequence[Run]:
        """The repetitions of a cell."""
        if cell not in self.runs:
            named = " ".join((cell.scene, cell.size, cell.labels, cell.init))
            raise Missing(f"this profile has no row {named}")
        return self.runs[cell]

    def errors(self, *cells: Cell) -> Array:
        """Median errors (N, 2, 1 + RESAMPLES) of cells, resampled over test paths and repetitions.

        Draws of the seeds are shared by the cells that differ in their labels alone: with one
        number their runs drew the same random numbers.
        """
        return np.array([self._errors_of(cell) for cell in cells])

    def _errors_of(self, cell: Cell) -> Array:
        runs = self.runs_of(cell)
        test = self.test_set(cell.scene, cell.size)
        name = SCORES[self.score][0]
        files = [self.file(f"runs/{run.directory}/{name}") for run in runs]
        key = cell, self.score
        if key not in self._errors:
            draw = generator_of("claims", "seeds", cell._replace(labels=""), len(runs))
            weights = seed_weights(len(runs), draw)
            seeds = [self._medians(file, test) for file in files]
            samples = [over_seeds(of_seeds, weights) for of_seeds in zip(*seeds, strict=True)]
            self._errors[key] = np.array(samples)
        return self._errors[key]

    def _medians(self, path: Path, test: TestSet) -> list[Array]:
        """Samples of both medians of one run's errors on the frames of a test set."""
        _, columns, measures = SCORES[self.score]
        table = read_errors(path, columns)
        if not np.array_equal(table["frame"], test.poses.frame):
            raise InputError(f"{path}: its frames are not those of the test set; {REMEDY}")
        return [medians(table[m].to_numpy(), test.path, test.counts) for m in measures]

    def test_set(self, scene: str, size: str) -> TestSet:
        """A test set, and the errors on it of always answering the mean true training pose."""
        train = self.file(f"labels/{scene}/{size}/synfeal/train.csv")
        common = self.score == COMMON
        sizes = {cell.size for cell in self.runs if cell.scene == scene} if common else {size}
        paths = [self.file(f"labels/{scene}/{one}/synfeal/test.csv") for one in sorted(sizes)]
        key = scene, size, common
        if key not in self._tests:
            tables = [read_pose_table(path) for path in paths]
            largest = max(tables, key=len)
            every = common_every([*map(len, tables)])
            poses = largest.at(np.arange(0, len(largest), every))
            straight, place = np.unique(poses.path, return_inverse=True)
            draw = (COMMON, scene) if common else (scene, size)
            counts = path_counts(len(straight), generator_of("claims", *draw))
            errors = pose_errors(constant_pose(read_pose_table(train), poses), poses)
            constant = np.array([medians(errors[m], place, counts) for m in MEASURES[:2]])
            self._tests[key] = TestSet(poses, place, counts, constant)
        self.test_paths[key] = self._tests[key].counts.shape[1]
        return self._tests[key]

    def not_learnt(self, cells: Iterable[Cell]) -> list[str]:
        """Which cells, trained on true labels, are not clearly better than the mean pose."""
        found = []
        for cell in cells:
            constant = self.test_set(cell.scene, cell.size).constant
            with np.errstate(invalid="ignore", divide="ignore"):
                shares = 100 * self._errors_of(cell) / constant
            for name, share in zip(QUANTITIES, shares, strict=True):
                low, high = limits(share)
                if not high < 100 * LEARNT:
                    text = f"{share[0]:.0f} % ({low:.0f} to {high:.0f}) of the mean pose's"
                    found.append(f"{TITLES[cell.model]}, {cell.size}: {name} error {text}")
        return found


def evidence_of(design: Design, root: Path) -> Evidence:
    """The results of a profile."""
    runs = defaultdict[Cell, list[Run]](list)
    for run in design.runs:
        runs[Cell(run.model, run.scene, run.size, run.labels, run.init)].append(run)
    return Evidence(root, dict(runs), design.estimated)
