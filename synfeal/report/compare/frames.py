"""Whether two trees tested on the same frames, and against the same labels."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.report.compare.runs import RunErrors, RunKey

Sameness = Literal["same", "differ", "unknown"]

# Trees of two machines may differ in the last digits of a pose; no picture shows that.
TOLERANCE = 1e-6


class FrameComparer:
    """Compares test frames of two trees; every file is read once.

    Attributes:
        roots: the trees A and B.
    """

    def __init__(self, root_a: Path, root_b: Path) -> None:
        self.roots = (root_a, root_b)
        self._tables: dict[Path, PoseTable | None] = {}

    def plans(self, key: RunKey, a: RunErrors, b: RunErrors) -> Sameness:
        """Whether two runs saw the same views, by path and true pose.

        Raises:
            InputError: a plan cannot be read.
        """
        if not (np.array_equal(a.frame, b.frame) and np.array_equal(a.path, b.path)):
            return "differ"
        return self._compare(f"plans/{key.scene}/test.csv", len(a.frame))

    def labels(self, key: RunKey, a: RunErrors, b: RunErrors) -> Sameness:
        """Whether the test sets of two runs carry the same labels.

        Raises:
            InputError: labels cannot be read.
        """
        if len(a.frame) != len(b.frame):
            return "differ"
        place = f"labels/{key.scene}/{key.size}/{key.labels}/test.csv"
        return self._compare(place, len(a.frame))

    def _compare(self, place: str, count: int) -> Sameness:
        a, b = (self._read(root / place) for root in self.roots)
        if a is None or b is None:
            return "unknown"
        if min(len(a), len(b)) < count:
            return "differ"
        a_rows, b_rows = (_rows(table.first(count)) for table in (a, b))
        return "same" if np.allclose(a_rows, b_rows, rtol=0, atol=TOLERANCE) else "differ"

    def _read(self, path: Path) -> PoseTable | None:
        if path not in self._tables:
            self._tables[path] = read_pose_table(path) if path.exists() else None
        return self._tables[path]


def _rows(table: PoseTable) -> NDArray[np.float64]:
    """A table as it stands in its file (N, 9)."""
    return np.column_stack([table.frame, table.path, table.position_m, table.quat_wxyz])
