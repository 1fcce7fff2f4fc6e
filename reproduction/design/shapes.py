"""Rows of Table 6 that differ in the shape of their label errors alone."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

from baselines.labels.methods import SIMULATOR
from reproduction.design.experiments import Experiment

TABLE = "table6_label_errors"
# Label errors by what they have in common, and how texts say it.
SHAPES = {
    "noise": "every frame has its own error",
    "offset": "all frames of a path share one error",
    "bend": "space is bent",
}


class ShapeRows(NamedTuple):
    """Rows of equally large label errors, one per shape, and the row of exact labels.

    Attributes:
        exact: The row whose labels are the simulator's.
        by_shape: The other rows, by the keys of ``SHAPES``.
    """

    exact: Experiment
    by_shape: dict[str, Experiment]


def shape_rows(rows: Iterable[Experiment]) -> ShapeRows | None:
    """Select the rows of the largest label errors that the design has in all shapes.

    Args:
        rows: Rows of the design.

    Returns:
        The rows; None where no size of error is there in all shapes and beside exact labels. Of
        several data sets the first by name is taken.
    """
    table = [row for row in rows if row.table == TABLE]
    exact = {(row.scene, row.size): row for row in table if row.labels == SIMULATOR}
    wrong = [row for row in table if row.labels in SHAPES]
    for key in sorted(exact):
        own = [row for row in wrong if (row.scene, row.size) == key]
        largest = largest_in_all_shapes((row.labels, row.noise_m, row.noise_deg) for row in own)
        if largest is not None:
            chosen = [row for row in own if (row.noise_m, row.noise_deg) == largest]
            return ShapeRows(exact[key], {row.labels: row for row in chosen})
    return None


def largest_in_all_shapes(errors: Iterable[tuple[str, float, float]]) -> tuple[float, float] | None:
    """Return the largest size of label errors that is there in all shapes.

    Args:
        errors: Shape, position error in metres and orientation error in degrees of each label set.

    Returns:
        Metres and degrees; None where no size is there in all shapes.
    """
    shapes: defaultdict[tuple[float, float], set[str]] = defaultdict(set)
    for shape, position_m, orientation_deg in errors:
        shapes[position_m, orientation_deg].add(shape)
    return max((size for size, found in shapes.items() if found >= {*SHAPES}), default=None)
