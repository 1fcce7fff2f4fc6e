"""Effects that the claims assert, computed from one replication or from the printed tables.

All are differences of logarithms of median errors: positive where an error is larger, adding where
factors multiply, the mean over localizers being a geometric mean of their ratios. The same
functions read the paper's tables, so that an effect and its printed counterpart mean the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

import numpy as np
import pandas as pd

from reproduction.claims.evidence import COMMON, QUANTITIES, Cell
from reproduction.claims.training import LENGTHS, images_ratio
from reproduction.replications.archive import (
    ASSISTANCE,
    ERRORS,
    FAILED,
    KEYS,
    OWN,
    UNITS,
    read_archived,
)
from reproduction.tables.cells import published_frame
from synfeal.evaluation.bootstrap import Array, medians, path_counts
from synfeal.records.provenance import generator_of
from synfeal.records.tables import rows_of

RESAMPLES = 1000  # resamples of the test paths: enough for a standard error
PAPERS_FIVE = ("posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2")
RIVALS = ("sfm", "rgbd-toro", "rgbd-g2o")
TURNED, MOVED, BOTH = "noise-p0-r20", "noise-p0.3-r0", "noise-p0.3-r20"
SIZES = {"large_room": ("6k", "80k"), "sanctuary": ("6k", "95k")}
Against = Literal["labels", "true"]
# Size: two thirds of the printed effect. Direction: 5 %. Order: by however little.
Asked = Literal["size", "direction", "order"]


class Effect(NamedTuple):
    """One effect of a claim."""

    claim: str
    part: str
    quantity: str  # position or orientation, or what else is compared
    against: Against
    asked: Asked
    sign: int  # that the paper claims: 1 where errors, or images, become more
    sample: Array  # (1 + resamples,) logarithm of a ratio: observed, then resampled


class Source(Protocol):
    """Errors of cells, as logarithms."""

    def log_errors(self, cell: Cell, test_set: str, against: Against) -> Array:
        """Return logarithms (2, B) of the median position and orientation error of a cell."""


@dataclass(frozen=True)
class Archive:
    """One archived replication."""

    folder: Path

    @cached_property
    def _groups(self) -> dict[tuple[str, ...], pd.DataFrame]:
        errors = read_archived(self.folder / ERRORS)
        return {
            tuple(map(str, key)): rows
            for key, rows in errors.groupby(list(KEYS), observed=True, sort=False)
        }

    def log_errors(self, cell: Cell, test_set: str, against: Against) -> Array:
        """Sample over the test paths; cells on the same test set share the draws."""
        rows = self._groups[(cell.scene, cell.size, cell.labels, cell.init, cell.model, test_set)]
        _, place = np.unique(rows["path"], return_inverse=True)
        draw = generator_of("replication", cell.scene, test_set, cell.size * (test_set == OWN))
        counts = path_counts(int(place.max()) + 1, draw, RESAMPLES)
        names = [f"true_{unit}" if against == "true" else unit for unit in UNITS]
        values = [rows[name].to_numpy(dtype=float) for name in names]
        failed = [np.where(v == FAILED, np.inf, v) for v in values]
        found = np.array([medians(v, place, counts) for v in failed])
        with np.errstate(divide="ignore"):
            logs: Array = np.log(found)
        return logs

    @cached_property
    def assistance(self) -> pd.DataFrame:
        """Batches of each label method, and how many of them needed assistance."""
        table = pd.read_csv(self.folder / ASSISTANCE)
        return table[table["split"] == "total"].set_index("method")


class Printed:
    """Tables 2 to 5 of the paper."""

    @cached_property
    def _cells(self) -> dict[Cell, tuple[float, float]]:
        names = ("table2_ground_truth", "table3_inconsistencies", "table4_size")
        frames = [published_frame(name) for name in (*names, "table5_from_scratch")]
        found = {}
        for row in rows_of(pd.concat(frames)):
            noise = f"noise-p{row.noise_m:g}-r{row.noise_deg:g}"
            labels = noise if row.labels == "noise" else row.labels
            cell = Cell(row.model, row.scene, row.size, labels, row.init)
            found[cell] = (row.position_m, row.orientation_deg)
        return found

    def log_errors(self, cell: Cell, test_set: str, against: Against) -> Array:
        """Return logarithms (2, 1) of the printed errors; their unit does not matter to ratios."""
        logs: Array = np.log(np.array([self._cells[cell]]).T)
        return logs


def label_effects(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of labels: claims C1, C2, C3, C5 and C6."""

    def ratio(new: Cell, old: Cell) -> Array:
        return source.log_errors(new, OWN, against) - source.log_errors(old, OWN, against)

    def mean_ratio(labels: str, instead_of: str) -> Array:
        pairs = [(Cell(m, labels=labels), Cell(m, labels=instead_of)) for m in PAPERS_FIVE]
        return np.asarray(np.mean([ratio(*pair) for pair in pairs], axis=0))

    for rival in RIVALS:
        found = mean_ratio("synfeal", rival)
        for quantity, sample in zip(QUANTITIES, found, strict=True):
            yield Effect(
                "C1", f"exact labels, not {rival}", quantity, against, "direction", -1, sample
            )
    better = ratio(Cell("posenet2"), Cell("posenet2", labels="sfm"))
    newer = ratio(Cell("posenet2"), Cell("posenet"))
    for index, quantity in enumerate(QUANTITIES):
        by_labels, by_model = better[index], newer[index]
        yield Effect("C2", "exact labels, not sfm", quantity, against, "size", -1, by_labels)
        parts = {
            "better labels": by_labels,
            "newer model": by_model,
            "labels more than model": by_labels - by_model,
        }
        for part, sample in parts.items():
            yield Effect("C3", part, quantity, against, "direction", -1, sample)
    turned, moved, both = (mean_ratio(labels, "synfeal") for labels in (TURNED, MOVED, BOTH))
    for part, quantity, sample in (
        ("orientation noise", "orientation", turned[1]),
        ("orientation noise, more than on position", "orientation", turned[1] - turned[0]),
        ("position noise", "position", moved[0]),
        ("position noise, more than on orientation", "position", moved[0] - moved[1]),
        ("both", "position", both[0]),
        ("both", "orientation", both[1]),
    ):
        yield Effect("C5", part, quantity, against, "direction", 1, sample)
    clean = ratio(Cell("posenet2"), Cell("posenet2", labels=BOTH))
    for quantity, sample in zip(QUANTITIES, clean, strict=True):
        yield Effect("C6", "no noise, not the most", quantity, against, "size", -1, sample)


def training_effects(source: Source) -> Iterator[Effect]:
    """Yield the effects of size and start: claims C7, C8, C10, C11 and C12."""

    def log_errors(cell: Cell) -> Array:
        return source.log_errors(cell, COMMON, "true")

    def effect(
        claim: str, part: str, quantity: str, asked: Asked, sign: int, sample: Array
    ) -> Effect:
        return Effect(claim, part, quantity, "true", asked, sign, sample)

    for claim, scene in (("C7", "large_room"), ("C8", "sanctuary")):
        small, large = SIZES[scene]
        changes = [
            log_errors(Cell(model, scene, large)) - log_errors(Cell(model, scene, small))
            for model in PAPERS_FIVE
        ]
        for quantity, sample in zip(QUANTITIES, np.mean(changes, axis=0), strict=True):
            yield effect(claim, f"{large}, not {small}", quantity, "size", -1, sample)
    scratch = {
        size: np.array(
            [
                log_errors(Cell(model, size=size, init="scratch"))
                - log_errors(Cell(model, size=size))
                for model in PAPERS_FIVE
            ]
        )
        for size in ("6k", "20k", "80k")
    }
    for size in ("6k", "20k"):
        for quantity, sample in zip(QUANTITIES, scratch[size].mean(axis=0), strict=True):
            yield effect("C10", f"from scratch, {size}", quantity, "direction", 1, sample)
    # Three of five are better in both errors when the third best of their worse errors is.
    third = np.sort(scratch["80k"].max(axis=1), axis=0)[2]
    yield effect("C11", "from scratch, 80k, third best", "the worse of both", "order", -1, third)
    claimed = Cell("posenet2", size="80k", init="scratch")
    own = log_errors(claimed)[0]
    for init in ("pretrained", "scratch"):
        for size in ("6k", "20k", "80k"):
            for model in PAPERS_FIVE:
                rival = Cell(model, size=size, init=init)
                if rival != claimed:
                    name = f"not {model}, {init}, {size}"
                    sample = own - log_errors(rival)[0]
                    yield effect("C12", name, "position", "order", -1, sample)


def image_effects(archive: Archive) -> Iterator[Effect]:
    """Yield the effect of claim C13: images from scratch for the errors after transfer learning."""
    logs = []
    for model in PAPERS_FIVE:
        old, new = (
            np.array(
                [
                    archive.log_errors(Cell(model, init=f"{start}{end}"), COMMON, "true").mean(
                        axis=0
                    )
                    for end in LENGTHS
                ]
            )
            for start in ("pretrained", "scratch")
        )
        logs.append(images_ratio(new, old))
    yield Effect("C13", "from scratch", "images", "true", "size", 1, np.mean(logs, axis=0))


def network_effects(source: Source) -> Iterator[Effect]:
    """Yield the error of each network over the geometric mean of the five, over rows of Table 4.

    They belong to no claim: the paper prints an order of networks without a sentence on it.
    """
    rows = [(scene, size) for scene, ends in SIZES.items() for size in ends]
    logs = np.array(
        [[source.log_errors(Cell(m, *row), COMMON, "true") for row in rows] for m in PAPERS_FIVE]
    )
    found = (logs - logs.mean(axis=0)).mean(axis=1)
    for model, samples in zip(PAPERS_FIVE, found, strict=True):
        for quantity, sample in zip(QUANTITIES, samples, strict=True):
            yield Effect(NETWORKS, model, quantity, "true", "order", 1, sample)


NETWORKS = "networks"
PRINTED_HOURS = {"scratch": 114.0, "pretrained": 72.0}  # section 4.4


def printed_effects() -> dict[tuple[str, str, str, Against], float]:
    """Compute each effect, by claim, part, quantity and score, from the printed tables."""
    printed = Printed()
    effects = [
        *label_effects(printed, "labels"),
        *label_effects(printed, "true"),
        *training_effects(printed),
        *network_effects(printed),
    ]
    found = {effect[:4]: float(effect.sample[0]) for effect in effects}
    hours = float(np.log(PRINTED_HOURS["scratch"] / PRINTED_HOURS["pretrained"]))
    return {**found, ("C13", "from scratch", "images", "true"): hours}


def effects_of(archive: Archive) -> list[Effect]:
    """Compute every effect of one replication."""
    return [
        *label_effects(archive, "labels"),
        *label_effects(archive, "true"),
        *training_effects(archive),
        *image_effects(archive),
        *network_effects(archive),
    ]
