"""What figures are drawn from: a profile's design and its result files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from synfeal.config import Design
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.frames import MAYBE, read_frame
from synfeal.geometry.poses import pose_error
from synfeal.report import speed_vs_error
from synfeal.report.assistance import batch_records
from synfeal.report.cells import schema_of

Array = NDArray[np.float64]
SPLITS = ("train", "test")


@dataclass(frozen=True)
class Results:
    """A profile's results."""

    root: Path  # its directory
    design: Design  # of the profile; what it leaves out is not drawn, whatever files there are

    @property
    def scenes(self) -> list[str]:
        """The scenes of the design, in the order of their names."""
        return sorted({row.scene for row in self.design.rows})

    def table(self, name: str) -> pd.DataFrame:
        """``tables/<name>.csv``."""
        schema = speed_vs_error.SCHEMA if name == speed_vs_error.NAME else schema_of(name)
        # What is drawn is a number or a gap, a count too.
        kinds = {column: MAYBE if kind.optional else kind for column, kind in schema.items()}
        return read_frame(self.root / "tables" / f"{name}.csv", kinds)

    def speeds(self, stage: str) -> pd.DataFrame:
        """The rows of ``speed_vs_error.csv`` of one stage."""
        table = self.table(speed_vs_error.NAME)
        return table[table["stage"] == stage]

    def labels(self, scene: str, size: str, labels: str, split: str) -> PoseTable:
        """The poses a data set carries; those of ``synfeal`` are the true ones."""
        return read_pose_table(self.root / "labels" / scene / size / labels / f"{split}.csv")

    def sizes(self, scene: str) -> list[str]:
        """Data set sizes of a scene in the design, the smallest first."""
        names = dict.fromkeys(row.size for row in self.design.rows if row.scene == scene)
        return sorted(names, key=lambda size: len(self.labels(scene, size, "synfeal", "train")))


# Makes a figure, or returns None when the design does not make what it shows.
Draw = Callable[[Results], Figure | None]


def counted(n_train: int, n_test: int) -> str:
    """Frames of a data set as figures say it."""
    return f"{n_train:,} training, {n_test:,} test frames"


@dataclass(frozen=True)
class LabelledSplit:
    """One split with the labels of one method."""

    labels: PoseTable  # the poses the method found, chained and assisted
    truth: PoseTable  # the true poses of the same frames
    # Records of assistance in the order of their frames ``start`` to ``stop`` (exclusive); each
    # begins with the last frame of the one before.
    batches: Sequence[Mapping[str, Any]]

    @property
    def errors(self) -> tuple[Array, Array]:
        """Position error in metres (N,) and orientation error in degrees (N,)."""
        position, angle = pose_error(self.labels.world_from_cam, self.truth.world_from_cam)
        return position, np.degrees(angle)


@dataclass(frozen=True)
class LabelledSet:
    """A data set with the labels of all methods: by method, then by split."""

    scene: str
    size: str
    methods: dict[str, dict[str, LabelledSplit]]


def read_labelled_set(results: Results) -> LabelledSet | None:
    """The first data set of the design that ground-truth methods label; none if there is none."""
    sets = results.design.estimated
    if not sets:
        return None
    scene, size, _ = sets[0]
    methods = [method for *data_set, method in sets if data_set == [scene, size]]
    return LabelledSet(scene, size, {m: _read(results, scene, size, m) for m in methods})


def _read(results: Results, scene: str, size: str, method: str) -> dict[str, LabelledSplit]:
    return {
        split: LabelledSplit(
            results.labels(scene, size, method, split),
            results.labels(scene, size, "synfeal", split),
            batch_records(results.root, scene, size, method, split),
        )
        for split in SPLITS
    }
