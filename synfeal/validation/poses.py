"""Poses are rigid, those of the tables, and of one split; which frames they let be compared."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from synfeal.dataset.finish import MANIFEST
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.split_frames import rows_of_frames, table_problems
from synfeal.errors import InputError
from synfeal.validation.frames import Poses
from synfeal.validation.listing import POSE, Check, Frame, SequenceListing, frames_of

# Text with ten decimals is exact to 1e-10.
ORTHONORMAL_BOUND = 1e-6
# KinectFusion integrates rotations in single precision: the determinants of 7-Scenes' own poses are
# up to a few 1e-4 from 1.
FOREIGN_ORTHONORMAL_BOUND = 1e-3
TABLE_BOUND = 1e-8  # of a number up to 100; of larger ones the same eleven digits
TABLE_RATIO = 1e-10


def rigid_bound(dataset: Path) -> float:
    """Return how far from rigid the poses of a data set may be: less where it is one of ours."""
    ours = os.path.lexists(dataset / MANIFEST)
    return ORTHONORMAL_BOUND if ours else FOREIGN_ORTHONORMAL_BOUND


def check_rigid(poses: Poses, unreadable: tuple[str, ...], bound: float) -> Check:
    """Check that rotations are orthonormal with determinant +1 and the last row is 0 0 0 1.

    Args:
        poses: Of each frame.
        unreadable: What is wrong with those that could not be read.
        bound: Largest difference of any of these numbers, see :func:`rigid_bound`.
    """
    names = ("R'R differs from 1", "det R differs from +1", "the last row differs from 0 0 0 1")
    defects = rigid_defects(np.array(list(poses.values())).reshape(-1, 4, 4))
    failures = [
        f"{frame.path(POSE)}: no rigid pose, {names[row.argmax()]} by {row.max():.2g}"
        for frame, row in zip(poses, defects, strict=True)
        if row.max() > bound
    ]
    worst = defects.max(initial=0.0)
    text = f"{len(poses)} poses, farthest from rigid {worst:.1e} (bound {bound:g})"
    return Check("poses", text, (*unreadable, *failures))


def rigid_defects(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Measure defects (N, 3) of poses (N, 4, 4): orthonormality, determinant, last row."""
    with np.errstate(over="ignore", invalid="ignore"):
        rotation = pose[:, :3, :3]
        gram = np.swapaxes(rotation, 1, 2) @ rotation
        orthonormal = np.abs(gram - np.eye(3)).max(axis=(1, 2))
        determinant = np.abs(np.linalg.det(rotation) - 1.0)
    last_row = np.abs(pose[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1)
    defects = np.stack([orthonormal, determinant, last_row], axis=1)
    return np.asarray(np.nan_to_num(defects, nan=np.inf))


def rigid_poses(poses: Poses, bound: float) -> Poses:
    """Select the poses that can be used; :func:`check_rigid` names the others."""
    return {
        frame: pose for frame, pose in poses.items() if rigid_defects(pose[None]).max() <= bound
    }


def check_tables(
    dataset: Path, poses: Poses, splits: Mapping[str, Iterable[SequenceListing]]
) -> Check:
    """Check that the poses of the frames are those of ``train.csv`` and ``test.csv``."""
    failures: list[str] = []
    differences: list[float] = []
    bound = TABLE_BOUND
    for split, sequences in splits.items():
        path, frames = dataset / f"{split}.csv", frames_of(sequences)
        if not path.exists():
            continue
        try:
            table = read_pose_table(path)
        except InputError as error:
            failures.append(str(error))
            continue
        if problems := table_problems(path, frames):
            failures += problems
            continue
        bound = max(bound, TABLE_RATIO * float(np.abs(table.position_m).max(initial=0.0)))
        matrices = table.world_from_cam[rows_of_frames(path, frames)]
        for frame, row in zip(frames, matrices, strict=True):
            if frame in poses:
                differences.append(float(np.abs(poses[frame] - row).max()))
                if differences[-1] > bound:
                    wrong = f"differs from {path.name} by {differences[-1]:.2g}"
                    failures.append(f"{frame.path(POSE)}: {wrong}")
        rows = np.flatnonzero(table.quat_wxyz[:, 0] < 0.0)
        if len(rows):
            failures.append(
                f"{path}: row {rows[0] + 2} and {len(rows) - 1} others hold quaternions with"
                " qw < 0; of the two of a rotation the one with qw >= 0 belongs here: change the"
                " sign of all four numbers"
            )
    if not differences and not failures:
        return Check("tables", "no train.csv or test.csv", skipped=True)
    worst = max(differences, default=0.0)
    text = f"{len(differences)} poses, farthest from its row {worst:.1e} (bound {bound:.1g})"
    return Check("tables", text, tuple(failures))


def check_leaks(poses: Poses, splits: Mapping[str, list[SequenceListing]]) -> Check:
    """Check that no test frame is taken from the pose of a training frame."""
    frames = frames_of(splits.get("train", []))
    train = {poses[frame].tobytes(): frame for frame in frames if frame in poses}
    test = [frame for frame in frames_of(splits.get("test", [])) if frame in poses]
    if not (train and test):
        return Check("overlap", "not both training and test frames", skipped=True)
    failures = [
        f"{frame.path(POSE)}: is the pose of {train[key].path(POSE)}, a training frame"
        for frame in test
        if (key := poses[frame].tobytes()) in train and train[key] != frame
    ]
    text = f"{len(test)} test poses, none of them a training pose"
    return Check("overlap", text, tuple(failures))


GAPS = (1, 5, 20)  # frames apart: neighbours see the most, distant ones tell angles and lengths
N_NEAREST = 2  # frames of the most similar pose, which of independent poses see the most
PAIRS_PER_GAP = 200  # evenly spread over larger sets


def choose_pairs(
    sequences: Iterable[SequenceListing], usable: Poses, every: bool
) -> list[tuple[Frame, Frame]]:
    """Choose pairs of frames ``GAPS`` apart, and of each frame with those of most similar poses.

    Args:
        sequences: Sequences of the data set; both frames of a pair are of one.
        usable: Poses of the frames that may be chosen.
        every: Take all pairs; otherwise at most ``PAIRS_PER_GAP`` for each gap and as many of
            similar poses, evenly spread.

    Returns:
        Pairs, the earlier frame first.
    """
    sequences = list(sequences)
    kinds = [
        [
            (frame, Frame(frame.sequence, frame.number + gap))
            for frame in frames_of(sequences)
            if frame in usable and Frame(frame.sequence, frame.number + gap) in usable
        ]
        for gap in GAPS
    ]
    kinds.append([pair for sequence in sequences for pair in _nearest(sequence, usable)])
    chosen: set[tuple[Frame, Frame]] = set()
    for pairs in kinds:
        index = np.arange(len(pairs))
        if not every and len(pairs) > PAIRS_PER_GAP:
            index = np.linspace(0, len(pairs) - 1, PAIRS_PER_GAP).round().astype(int)
        chosen.update(pairs[i] for i in index)
    order = {sequence.path: index for index, sequence in enumerate(sequences)}
    return sorted(chosen, key=lambda p: (order[p[0].sequence], p[0].number, p[1].number))


def _nearest(sequence: SequenceListing, usable: Poses) -> list[tuple[Frame, Frame]]:
    """Pair each frame with the ``N_NEAREST`` of the most similar poses, the earlier frame first.

    A turn by a radian counts as much as a step across the space that the cameras are in.
    """
    frames = [frame for frame in sequence.frames if frame in usable]
    if len(frames) <= N_NEAREST:
        return []
    poses = np.array([usable[frame] for frame in frames])
    position, axes = poses[:, :3, 3], poses[:, :3, [0, 2]].reshape(-1, 6)
    extent_m = max(float(np.linalg.norm(np.ptp(position, axis=0))), 1e-6)
    features = np.column_stack([position / extent_m, axes])
    _, found = KDTree(features).query(features, k=N_NEAREST + 1)
    numbers = {
        (min(i, j), max(i, j)) for i, row in enumerate(found.tolist()) for j in row if i != j
    }
    return [(frames[i], frames[j]) for i, j in sorted(numbers)]
