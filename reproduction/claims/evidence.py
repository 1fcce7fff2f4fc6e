"""Evidence for the tests of the claims: a median error per cell of a run, resampled.

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
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from baselines.labels.constant import constant_pose
from reproduction.design.experiments import Design, Run, common_every
from reproduction.statistics.limits import COLUMNS, COMMON_COLUMNS, MEASURES, REMEDY, read_errors
from reproduction.statistics.seeds import Borrowed, Group, Layout, borrowed_deviations, limits
from reproduction.tables.layouts import TITLES
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.evaluation.bootstrap import RESAMPLES, Array, Counts, medians, path_counts
from synfeal.evaluation.metrics import pose_errors
from synfeal.records.provenance import generator_of

# A localizer has learnt where its whole interval lies below this share of the mean pose's error.
LEARNT = 0.75
# Errors of a cell are two samples (2, B) of medians, metres and degrees, as `Layout` lays them out.
QUANTITIES = ("position", "orientation")
# File, its columns and the two errors of each score; on the common test set both are against truth.
COMMON = "common"
SCORES = {
    "labels": ("errors.csv", COLUMNS, MEASURES[:2]),
    "true": ("errors.csv", COLUMNS, MEASURES[2:]),
    COMMON: ("common_errors.csv", COMMON_COLUMNS, MEASURES[:2]),
}
# Measures of the tables whose deviations over seeds a single run borrows.
BORROWS = {"labels": MEASURES[:2], "true": MEASURES[2:], COMMON: MEASURES[2:]}


class Missing(Exception):  # noqa: N818 - not an error: it ends in the verdict `not testable here`
    """The profile does not make what a claim needs; the message says what."""


class Cell(NamedTuple):
    """One trained localizer, whatever tables show it; the defaults are those of Table 2."""

    model: str
    scene: str = "large_room"
    size: str = "6k"
    labels: str = "synfeal"
    init: str = "pretrained"


def cell_of(run: Run) -> Cell:
    """Return the cell that a run is a repetition of."""
    return Cell(run.model, run.scene, run.size, run.labels, run.init)


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
    # By test set, how many paths it has.
    test_paths: dict[tuple[str, str, bool], int] = field(default_factory=dict)
    _errors: dict[tuple[Cell, str], Array] = field(default_factory=dict)
    _tests: dict[tuple[str, str, bool], TestSet] = field(default_factory=dict)

    def under(self, score: str) -> Evidence:
        """Return the same results under a score, with nothing read yet."""
        return replace(self, score=score, test_paths={})

    def file(self, relative: str) -> Path:
        """Return a result file that the design makes.

        Raises:
            InputError: It is not there.
        """
        path = self.root / relative
        if not path.is_file():
            raise InputError(f"{path}: missing; make the results again")
        return path

    def need(self, **keys: str) -> None:
        """Make sure that the profile has cells with some values."""
        if not any(all(getattr(c, k) == v for k, v in keys.items()) for c in self.runs):
            raise Missing(f"this profile has no row {' '.join(keys.values())}")

    def runs_of(self, cell: Cell) -> Sequence[Run]:
        """Return the repetitions of a cell."""
        if cell not in self.runs:
            named = " ".join((cell.scene, cell.size, cell.labels, cell.init))
            raise Missing(f"this profile has no row {named}")
        return self.runs[cell]

    def errors(self, *cells: Cell) -> Array:
        """Sample the median errors (N, 2, B) of cells over test paths and training runs."""
        return np.array([self._errors_of(cell) for cell in cells])

    def _errors_of(self, cell: Cell) -> Array:
        runs = self.runs_of(cell)
        test = self.test_set(cell.scene, cell.size)
        name = SCORES[self.score][0]
        files = [self.file(f"runs/{run.directory}/{name}") for run in runs]
        key = cell, self.score
        if key not in self._errors:
            seeds = [self._medians(file, test) for file in files]
            place = [*self.groups].index(self._group_of(cell))
            lent = self._borrowed(cell.model)
            deviations = [lent[measure].relative_sd for measure in BORROWS[self.score]]
            samples = [
                self.layout.sample(of_seeds, place, deviation)
                for of_seeds, deviation in zip(zip(*seeds, strict=True), deviations, strict=True)
            ]
            self._errors[key] = np.array(samples)
        return self._errors[key]

    def _borrowed(self, model: str) -> dict[str, Borrowed]:
        return {measure: borrowed_deviations()[model, measure] for measure in MEASURES}

    def _group_of(self, cell: Cell) -> tuple[Cell, int]:
        """Name the runs that a cell's repetitions move with, and count them.

        Cells that differ in their labels alone drew the same random numbers in each repetition, so
        that what one repetition moves in all of them is left out of all at once. A single run
        borrows its deviation, and how much of it two label sets share is not known: each is taken
        to vary by itself.
        """
        runs = self.runs_of(cell)
        return (cell._replace(labels="") if len(runs) > 1 else cell), len(runs)

    @cached_property
    def groups(self) -> dict[tuple[Cell, int], Group]:
        """The groups of runs that move together."""
        found = {}
        for cell in self.runs:
            name, n_seeds = self._group_of(cell)
            lent = self._borrowed(cell.model)
            fewest = min(lent[measure].degrees_of_freedom for measure in BORROWS[self.score])
            degrees = n_seeds - 1 if n_seeds > 1 else fewest
            found[name, n_seeds] = Group(n_seeds, degrees, borrowed=n_seeds == 1)
        return found

    @cached_property
    def layout(self) -> Layout:
        """Layout of every sample: resamples of the paths, then seed rows of each group of runs."""
        return Layout(RESAMPLES, tuple(self.groups.values()))

    def _medians(self, path: Path, test: TestSet) -> list[Array]:
        """Sample both medians of one run's errors on the frames of a test set."""
        _, columns, measures = SCORES[self.score]
        table = read_errors(path, columns)
        if not np.array_equal(table["frame"], test.poses.frame):
            raise InputError(f"{path}: its frames are not those of the test set; {REMEDY}")
        return [medians(table[m].to_numpy(), test.path, test.counts) for m in measures]

    def pose_tables(self, scene: str, size: str) -> list[str]:
        """List the files of the true poses that a test set is made from, of training first."""
        sizes = {size}
        if self.score == COMMON:
            sizes = {cell.size for cell in self.runs if cell.scene == scene}
        tests = [f"labels/{scene}/{one}/synfeal/test.csv" for one in sorted(sizes)]
        return [f"labels/{scene}/{size}/synfeal/train.csv", *tests]

    def test_set(self, scene: str, size: str) -> TestSet:
        """Return a test set, and the errors on it of always answering the mean training pose."""
        train, *paths = map(self.file, self.pose_tables(scene, size))
        common = self.score == COMMON
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
            answers = [medians(errors[m], place, counts) for m in MEASURES[:2]]
            constant = np.array([self.layout.constant(answer) for answer in answers])
            self._tests[key] = TestSet(poses, place, counts, constant)
        self.test_paths[key] = self._tests[key].counts.shape[1]
        return self._tests[key]

    def not_learnt(self, cells: Iterable[Cell]) -> list[str]:
        """List cells, trained on true labels, that are not clearly better than the mean pose."""
        found = []
        for cell in cells:
            constant = self.test_set(cell.scene, cell.size).constant
            with np.errstate(invalid="ignore", divide="ignore"):
                shares = 100 * self._errors_of(cell) / constant
            for name, share in zip(QUANTITIES, shares, strict=True):
                low, high = limits(share, self.layout)
                if not high < 100 * LEARNT:
                    text = f"{share[0]:.0f} % ({low:.0f} to {high:.0f}) of the mean pose's"
                    found.append(f"{TITLES[cell.model]}, {cell.size}: {name} error {text}")
        return found


def evidence_of(design: Design, root: Path) -> Evidence:
    """Collect the results of a profile."""
    runs = defaultdict[Cell, list[Run]](list)
    for run in design.runs:
        runs[cell_of(run)].append(run)
    return Evidence(root, dict(runs), design.estimated)
