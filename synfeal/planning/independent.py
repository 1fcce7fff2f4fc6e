"""Frames that have nothing to do with each other: the simulator's mode ``random``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import CollectionConfig
from synfeal.errors import InputError
from synfeal.mesh.rays import RayCaster
from synfeal.planning.candidates import BLOCK
from synfeal.planning.connected import connected_space
from synfeal.planning.sampling import PoseVectors, sample_poses
from synfeal.planning.target import has_free_view


def independent_poses(
    caster: RayCaster,
    bounds: NDArray[np.float64],
    min_view_distance_m: float,
    collection: CollectionConfig,
    n_frames: int,
    rng: np.random.Generator,
) -> PoseVectors:
    """Pose vectors (n_frames, 6), uniform among those with a free view in the connected space.

    Every admissible candidate is kept, so a round of candidates gives as many frames as it has
    admissible ones, and ``candidates`` does not change what is drawn. A shorter plan is a prefix
    of a longer one.

    Raises:
        InputError: ``max_tries`` rounds of ``candidates`` in a row had no admissible pose.
    """
    tries = collection.max_tries
    space = connected_space(caster, bounds, min_view_distance_m, tries, rng)
    most_empty = -(-tries * collection.candidates // BLOCK)
    kept: list[PoseVectors] = []
    n_kept = n_empty = 0
    while n_kept < n_frames:
        poses = sample_poses(bounds, BLOCK, rng)
        poses = poses[has_free_view(caster, poses, min_view_distance_m)]
        kept.append(poses[space.contains(poses[:, :3])])
        n_kept += len(kept[-1])
        n_empty = 0 if len(kept[-1]) else n_empty + 1
        if n_empty >= most_empty:
            raise InputError(
                f"plan: no admissible pose among {n_empty * BLOCK} candidates; lower"
                f" min_view_distance_m ({min_view_distance_m} m), or widen sampling_box"
            )
    return np.concatenate(kept)[:n_frames]
