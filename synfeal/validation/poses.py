"""Poses: rigid, the same as in the tables, and none both in training and in test."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.validation.check import Check
from synfeal.validation.frames import Poses
from synfeal.validation.listing import POSE, Frame, SequenceListing

# Text with ten decimals is exact to 1e-10; 7-Scenes' own poses have eight significant digits.
ORTHONORMAL_BOUND = 1e-6
TABLE_BOUND = 1e-8  # of a number up to 100; of larger ones the same eleven digits
TABLE_RATIO = 1e-10


def check_rigid(poses: Poses, unreadable: tuple[str, ...]) -> Check:
    """Rotations are orthonormal with determinant +1, the last row is 0 0 0 1."""
    frames = list(poses)
    defects = rigid_defects(np.array([poses[frame] for frame in frames]).reshape(-1, 4, 4))
    failures = [
        f"{frames[index].path(POSE)}: no rigid pose, {_worst(row)}"
        for index, row in enumerate(defects)
        if row.max() > ORTHONORMAL_BOUND
    ]
    worst = defects.max(initial=0.0)
    text = f"{len(frames)} poses, farthest from rigid {worst:.1e} (bound {ORTHONORMAL_BOUND:g})"
    return Check("poses", text, (*unreadable, *failures))


def rigid_defects(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far poses (N, 4, 4) are from rigid, (N, 3): orthonormality, determinant, last row."""
    with np.errstate(over="ignore", invalid="ignore"):
        rotation = pose[:, :3, :3]
        gram = np.swapaxes(rotation, 1, 2) @ rotation
        orthonormal = np.abs(gram - np.eye(3)).max(axis=(1, 2))
        determinant = np.abs(np.linalg.det(rotation) - 1.0)
    last_row = np.abs(pose[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1)
    defects = np.stack([orthonormal, determinant, last_row], axis=1)
    return np.asarray(np.nan_to_num(defects, nan=np.inf))


def _worst(defects: NDArray[np.float64]) -> str:
    names = ("R'R differs from 1", "det R differs from +1", "the last row differs from 0 0 0 1")
    worst = int(np.argmax(defects))
    return f"{names[worst]} by {defects[worst]:.2g}"


def check_tables(
    dataset: Path, poses: Poses, splits: Mapping[str, Iterable[SequenceListing]]
) -> Check:
    """The poses of the frames are those of ``train.csv`` and ``test.csv``."""
    failures: list[str] = []
    n_compared, worst, bound = 0, 0.0, TABLE_BOUND
    for split, sequences in splits.items():
        path = dataset / f"{split}.csv"
        frames = [frame for sequence in sequences for frame in sequence.frames]
        if not path.exists():
            continue
        try:
            table = read_pose_table(path)
        except (InputError, ValueError) as error:
            failures.append(str(error) if isinstance(error, InputError) else f"{path}: {error}")
            continue
        if len(table) != len(frames):
            failures.append(f"{path}: {len(table)} rows for {len(frames)} frames")
            continue
        difference = _differences(frames, table.world_from_cam, poses)
        n_compared += len(difference)
        worst = max([worst, *difference.values()])
        bound = max(bound, TABLE_RATIO * float(np.abs(table.position_m).max(initial=0.0)))
        failures += [
            f"{frame.path(POSE)}: differs from {path.name} by {value:.2g}"
            for frame, value in difference.items()
            if value > bound
        ]
        failures += _negative(path, table)
    if not n_compared and not failures:
        return Check("tables", "no train.csv or test.csv", skipped=True)
    text = f"{n_compared} poses, farthest from its row {worst:.1e} (bound {bound:.1g})"
    return Check("tables", text, tuple(failures))


def _negative(path: Path, table: PoseTable) -> list[str]:
    """A failure if a quaternion is the one of the two of its rotation that has w < 0."""
    rows = np.flatnonzero(table.quat_wxyz[:, 0] < 0.0)
    if not len(rows):
        return []
    return [
        f"{path}: row {rows[0] + 2} and {len(rows) - 1} others hold quaternions with qw < 0; of the"
        " two of a rotation the one with qw >= 0 belongs here: change the sign of all four numbers"
    ]


def _differences(
    frames: list[Frame], table: NDArray[np.float64], poses: Poses
) -> dict[Frame, float]:
    """The largest difference between an entry of a frame's matrix and of its row's."""
    return {
        frame: float(np.abs(poses[frame] - row).max())
        for frame, row in zip(frames, table, strict=True)
        if frame in poses
    }
