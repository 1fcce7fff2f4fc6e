"""Which frames of a sequence are compared with each other."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial import KDTree

from synfeal.validation.frames import Poses
from synfeal.validation.listing import Frame, SequenceListing

GAPS = (1, 5, 20)  # frames apart: neighbours see the most, distant ones tell angles and lengths
N_NEAREST = 2  # frames of the most similar pose, which of independent poses see the most
PAIRS_PER_GAP = 200  # evenly spread over larger sets


def choose_pairs(
    sequences: Iterable[SequenceListing], usable: Poses, every: bool
) -> list[tuple[Frame, Frame]]:
    """Pairs ``GAPS`` frames apart, and each frame with those of the most similar poses.

    Of a sequence each; at most ``PAIRS_PER_GAP`` of each kind unless ``every``.
    """
    sequences = list(sequences)
    kinds = [
        [
            (frame, Frame(frame.sequence, frame.number + gap))
            for sequence in sequences
            for frame in sequence.frames
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
    """Each frame with the ``N_NEAREST`` of the most similar poses, the earlier frame first.

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
