"""The label sets that ground-truth methods re-estimated, with what happened to each batch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error
from synfeal.report.assistance import PUBLISHED_ASSISTED
from synfeal.report.figures.sources import SPLITS, Array, Results
from synfeal.report.results import read_result


@dataclass(frozen=True)
class BatchMark:
    """A batch as figures mark it: its frames ``start`` to ``stop`` (exclusive)."""

    start: int
    stop: int
    assisted: bool
    lost: bool


@dataclass(frozen=True)
class LabelledSplit:
    """One split with the labels of one method.

    Attributes:
        labels: the poses the method found, chained and assisted.
        truth: the true poses of the same frames.
        batches: in the order of their frames; each begins with the last frame of the one before.
    """

    labels: PoseTable
    truth: PoseTable
    batches: tuple[BatchMark, ...]

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
    """The first data set of the design that ground-truth methods label; none if there is none.

    Raises:
        InputError: labels or a record of assistance are missing or unreadable.
    """
    rows = [row for row in results.rows if row.labels in PUBLISHED_ASSISTED]
    if not rows:
        return None
    scene, size = rows[0].scene, rows[0].size
    methods = dict.fromkeys(r.labels for r in rows if (r.scene, r.size) == (scene, size))
    return LabelledSet(scene, size, {m: _read(results, scene, size, m) for m in methods})


def _read(results: Results, scene: str, size: str, method: str) -> dict[str, LabelledSplit]:
    path = results.root / "labels" / scene / size / method / "assistance.json"
    records = read_result(path, ["splits"], "chain these labels again")["splits"]
    return {
        split: LabelledSplit(
            results.labels(scene, size, method, split),
            results.labels(scene, size, "synfeal", split),
            tuple(
                BatchMark(batch["start"], batch["stop"], batch["assisted"], batch["lost"])
                for batch in records[split]["records"]
            ),
        )
        for split in SPLITS
    }
