"""The space the scene is about: what free lines connect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.rays import RayCaster
from synfeal.planning.space import PoseSpace
from synfeal.planning.start import largest_group

N_POSES = 256  # enough that a free place that sees none of their largest group is a rare nook


@dataclass(frozen=True)
class ConnectedSpace:
    """The largest free space of a scene, as what can be seen from places in it.

    Attributes:
        caster: rays against the mesh.
        hubs_m: (H, 3) places connected to each other by free lines of sight.
    """

    caster: RayCaster
    hubs_m: NDArray[np.float64]

    def contains(self, points_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether a free line joins each point (N, 3) to one of the hubs, (N,)."""
        found = np.zeros(len(points_m), dtype=np.bool_)
        for hub in self.hubs_m:
            left = np.flatnonzero(~found)
            if not len(left):
                break
            ends = points_m[left]
            found[left] = self.caster.sees(np.broadcast_to(hub, ends.shape), ends)
        return found


def connected_space(space: PoseSpace, max_tries: int) -> ConnectedSpace:
    """The space in which :func:`synfeal.planning.start.sample_start` starts a path.

    Raises:
        InputError: no pose with a free view was found; says what to relax.
    """
    return ConnectedSpace(space.caster, largest_group(space, max_tries, N_POSES)[:, :3])
