"""Poses are rigid, those of the tables, and of one split; which frames they let be compared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from synfeal.dataset.frame_poses import Poses, compare_tables, rigid_problems
from synfeal.dataset.sequence_listing import POSE, Frame, SequenceListing, frames_of
from synfeal.geometry.rigid import RIGID_BOUND, is_rigid, rigid_defects
from synfeal.validation.check import Check


def check_rigid(poses: Poses, unreadable: tuple[str, ...]) -> Check:
    """Check that rotations are orthonormal with determinant +1 and the last row is 0 0 0 1.

    Args:
        poses: Pose of each frame.
        unreadable: What is wrong with those that could not be read.
    """
    worst = rigid_defects(np.array(list(poses.values()))).worst.max(initial=0.0)
    text = f"{len(poses)} poses, farthest from rigid {worst:.1e} (bound {RIGID_BOUND:g})"
    return Check("poses", text, (*unreadable, *rigid_problems(poses)))


def rigid_poses(poses: Poses) -> Poses:
    """Select the poses that can be used; :func:`check_rigid` names the others."""
    return {frame: pose for frame, pose in poses.items() if is_rigid(pose)}


def check_tables(
    dataset: Path, poses: Poses, splits: Mapping[str, Iterable[SequenceListing]]
) -> Check:
    """Check that the poses of the frames are those of ``train.csv`` and ``test.csv``."""
    found = compare_tables(dataset, poses, splits)
    if not found.differences and not found.problems:
        return Check("tables", "no train.csv or test.csv", skipped=True)
    worst = max(found.differences, default=0.0)
    text = f"{len(found.differences)} poses, farthest from its row {worst:.1e}"
    return Check("tables", f"{text} (bound {found.bound:.1g})", found.problems)


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
