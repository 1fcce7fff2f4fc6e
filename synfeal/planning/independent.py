"""Frames that have nothing to do with each other: the simulator's mode ``random``."""

from __future__ import annotations

import numpy as np

from synfeal.config.models import CollectionConfig
from synfeal.errors import InputError
from synfeal.planning.candidates import BLOCK
from synfeal.planning.connected import connected_space
from synfeal.planning.sampling import PoseVectors
from synfeal.planning.space import PoseSpace


def independent_poses(space: PoseSpace, collection: CollectionConfig, n_frames: int) -> PoseVectors:
    """Pose vectors (n_frames, 6), uniform among those with a free view in the connected space.

    Every admissible candidate is kept, so a round of candidates gives as many frames as it has
    admissible ones, and ``candidates`` does not change what is drawn. A shorter plan is a prefix
    of a longer one.

    Raises:
        InputError: ``max_tries`` rounds of ``candidates`` in a row had no admissible pose.
    """
    tries = collection.max_tries
    connected = connected_space(space, tries)
    most_empty = -(-tries * collection.candidates // BLOCK)
    kept: list[PoseVectors] = []
    n_kept = n_empty = 0
    while n_kept < n_frames:
        poses = space.sample(BLOCK)
        poses = poses[space.has_free_view(poses)]
        kept.append(poses[connected.contains(poses[:, :3])])
        n_kept += len(kept[-1])
        n_empty = 0 if len(kept[-1]) else n_empty + 1
        if n_empty >= most_empty:
            raise InputError(
                f"plan: no admissible pose among {n_empty * BLOCK} candidates; lower"
                f" min_view_distance_m ({space.min_view_distance_m} m), or widen sampling_box"
            )
    return np.concatenate(kept)[:n_frames]
