"""The label sets that ground-truth methods re-estimated, with what happened to each batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error
from synfeal.report.assistance import batch_records, estimated_sets
from synfeal.report.figures.sources import SPLITS, Array, Results


@dataclass(frozen=True)
class LabelledSplit:
    """One split with the labels of one method.

    Attributes:
        labels: the poses the method found, chained and assisted.
        truth: the true poses of the same frames.
        batches: records of assistance in the order of their frames ``start`` to ``stop``
            (exclusive); each begins with the last frame of the one before.
    """

    labels: PoseTable
    truth: PoseTable
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
    sets = estimated_sets(results.rows)
    if not sets:
        return None
    _, scene, size = sets[0]
    methods = [method for method, *data_set in sets if data_set == [scene, size]]
    return LabelledSet(scene, size, {m: _read(results, scene, size, m) for m in methods})


def _read(results: Results, scene: str, size: str, method: str) -> dict[str, LabelledSplit]:
    return {
        split: LabelledSplit(
            results.labels(scene, size, method, split),
            results.labels(scene, size, "synfeal", split),
            batch_records(results.root, method, scene, size, split),
        )
        for split in SPLITS
    }
