"""Sources of figures: a profile's design and its result files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reproduction.design.experiments import Design
from reproduction.tables import speed_vs_error
from reproduction.tables.cells import schema_of
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.records.tables import MAYBE, read_frame

Array = NDArray[np.float64]
SPLITS = ("train", "test")


@dataclass(frozen=True)
class Results:
    """A profile's results."""

    root: Path  # its directory
    design: Design  # the profile's; what it leaves out is not drawn, whatever files there are

    @property
    def scenes(self) -> list[str]:
        """The scenes of the design, in the order of their names."""
        return sorted({row.scene for row in self.design.rows})

    def table(self, name: str) -> pd.DataFrame:
        """Read ``tables/<name>.csv``."""
        schema = speed_vs_error.SCHEMA if name == speed_vs_error.NAME else schema_of(name)
        # What is drawn is a number or a gap, a count too.
        kinds = {column: MAYBE if kind.optional else kind for column, kind in schema.items()}
        return read_frame(self.root / "tables" / f"{name}.csv", kinds)

    def speeds(self, stage: str) -> pd.DataFrame:
        """Read the rows of ``speed_vs_error.csv`` of one stage."""
        table = self.table(speed_vs_error.NAME)
        return table[table["stage"] == stage]

    def labels(self, scene: str, size: str, labels: str, split: str) -> PoseTable:
        """Read the poses that a data set carries as labels.

        Args:
            scene: Name of the scene.
            size: Name of the size.
            labels: Label set; ``synfeal`` are the true poses.
            split: ``train`` or ``test``.
        """
        return read_pose_table(self.root / "labels" / scene / size / labels / f"{split}.csv")

    def sizes(self, scene: str) -> list[str]:
        """List data set sizes of a scene in the design, the smallest first."""
        names = dict.fromkeys(row.size for row in self.design.rows if row.scene == scene)
        return sorted(names, key=lambda size: len(self.labels(scene, size, "synfeal", "train")))


# Makes a figure, or returns None when the design does not make what it shows.
Draw = Callable[[Results], Figure | None]


def counted(n_train: int, n_test: int) -> str:
    """Format the frames of a data set as figures print them."""
    return f"{n_train:,} training, {n_test:,} test frames"
