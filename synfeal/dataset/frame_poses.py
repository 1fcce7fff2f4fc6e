"""Poses of the frames of a data set, and what is wrong with them, one sentence per problem."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sequence_listing import POSE, Frame, SequenceListing, frames_of
from synfeal.dataset.sevenscenes import read_pose
from synfeal.dataset.split_frames import rows_of_frames, table_problems
from synfeal.errors import InputError
from synfeal.geometry.rigid import RIGID_BOUND, rigid_defects

Poses = dict[Frame, NDArray[np.float64]]

# Of a number up to 100; of larger ones the same eleven digits.
TABLE_BOUND, TABLE_RATIO = 1e-8, 1e-10


def read_poses(sequences: Iterable[SequenceListing]) -> tuple[Poses, tuple[str, ...]]:
    """Read the poses (4, 4) of all readable frames, and what is wrong with the others."""
    poses: Poses = {}
    problems: list[str] = []
    for sequence in sequences:
        for number in sorted(sequence.numbers[POSE]):
            frame = Frame(sequence.path, number)
            try:
                poses[frame] = read_pose(frame.path(POSE))
            except InputError as error:
                problems.append(str(error))
    return poses, tuple(problems)


def rigid_problems(poses: Poses) -> tuple[str, ...]:
    """Describe the poses that are no rotation and translation."""
    names = ("R'R differs from 1", "det R differs from +1", "the last row differs from 0 0 0 1")
    defects = np.stack(rigid_defects(np.array(list(poses.values()))), axis=1)
    return tuple(
        f"{frame.path(POSE)}: no rigid pose, {names[row.argmax()]} by {row.max():.2g}"
        for frame, row in zip(poses, defects, strict=True)
        if row.max() > RIGID_BOUND
    )


@dataclass(frozen=True)
class TableComparison:
    """Poses of frames beside those of ``train.csv`` and ``test.csv``.

    Attributes:
        differences: Largest difference of each frame that is in a table.
        bound: Largest difference that rounding explains.
        problems: What is wrong with the tables.
    """

    differences: tuple[float, ...]
    bound: float
    problems: tuple[str, ...]


def compare_tables(
    dataset: Path, poses: Poses, splits: Mapping[str, Iterable[SequenceListing]]
) -> TableComparison:
    """Compare the poses of the frames with those of ``train.csv`` and ``test.csv``, if any."""
    problems: list[str] = []
    differences: list[float] = []
    bound = TABLE_BOUND
    for split, sequences in splits.items():
        path, frames = dataset / f"{split}.csv", frames_of(sequences)
        if not path.exists():
            continue
        try:
            table = read_pose_table(path)
        except InputError as error:
            problems.append(str(error))
            continue
        if unlike := table_problems(path, frames):
            problems += unlike
            continue
        bound = max(bound, TABLE_RATIO * float(np.abs(table.position_m).max(initial=0.0)))
        matrices = table.world_from_cam[rows_of_frames(path, frames)]
        for frame, row in zip(frames, matrices, strict=True):
            if frame in poses:
                differences.append(float(np.abs(poses[frame] - row).max()))
                if differences[-1] > bound:
                    wrong = f"differs from {path.name} by {differences[-1]:.2g}"
                    problems.append(f"{frame.path(POSE)}: {wrong}")
        rows = np.flatnonzero(table.quat_wxyz[:, 0] < 0.0)
        if len(rows):
            problems.append(
                f"{path}: row {rows[0] + 2} and {len(rows) - 1} others hold quaternions with"
                " qw < 0; of the two of a rotation the one with qw >= 0 belongs here: change the"
                " sign of all four numbers"
            )
    return TableComparison(tuple(differences), bound, tuple(problems))
