"""Poses are rigid and those of the tables; splits are disjoint, and no pose is in both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.dataset.sevenscenes import SPLIT_FILES, read_split
from synfeal.errors import InputError, why
from synfeal.validation.frames import Poses
from synfeal.validation.listing import POSE, Check, Frame, SequenceListing

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


Splits = dict[str, list[SequenceListing]]


def read_splits(
    dataset: Path, sequences: Iterable[SequenceListing]
) -> tuple[Splits, tuple[str, ...]]:
    """The sequences of each split that can be read, in order, and what is wrong with the files."""
    by_path = {sequence.path: sequence for sequence in sequences}
    splits: Splits = {}
    failures: list[str] = []
    for split, name in SPLIT_FILES.items():
        try:
            directories = read_split(dataset, split)
        except InputError as error:
            failures.append(str(error))
            continue
        except (OSError, ValueError) as error:
            failures.append(f"{dataset / name}: cannot be read ({why(error)})")
            continue
        failures += [
            f"{dataset / name}: lists {path.name}, which is not there"
            for path in directories
            if path not in by_path
        ]
        splits[split] = [by_path[path] for path in directories if path in by_path]
    return splits, tuple(failures)


def check_splits(
    dataset: Path,
    sequences: Iterable[SequenceListing],
    splits: Mapping[str, list[SequenceListing]],
    unreadable: tuple[str, ...],
) -> Check:
    """Each sequence is in one split, once."""
    uses = {sequence.name: 0 for sequence in sequences}
    for listed in splits.values():
        for sequence in listed:
            uses[sequence.name] += 1
    names = " and ".join(SPLIT_FILES.values())
    failures = [
        f"{dataset / name}: is listed {count} times in {names}, must be listed once"
        for name, count in uses.items()
        if count != 1 and (count > 1 or not unreadable)
    ]
    parts = [
        f"{split} {sum(len(s.frames) for s in listed)} frames" for split, listed in splits.items()
    ]
    return Check("splits", ", ".join(parts) or names, (*unreadable, *failures))


def check_leaks(poses: Poses, splits: Mapping[str, list[SequenceListing]]) -> Check:
    """No test frame is taken from the pose of a training frame."""
    train = {
        poses[frame].tobytes(): frame
        for sequence in splits.get("train", [])
        for frame in sequence.frames
        if frame in poses
    }
    test = [f for sequence in splits.get("test", []) for f in sequence.frames if f in poses]
    if not (train and test):
        return Check("overlap", "not both training and test frames", skipped=True)
    failures = [
        f"{frame.path(POSE)}: is the pose of {train[key].path(POSE)}, a training frame"
        for frame in test
        if (key := poses[frame].tobytes()) in train and train[key] != frame
    ]
    text = f"{len(test)} test poses, none of them a training pose"
    return Check("overlap", text, tuple(failures))
