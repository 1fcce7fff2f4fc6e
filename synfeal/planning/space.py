"""What planning asks of a mesh, as one object: which poses there are, and which are admissible."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import SceneConfig
from synfeal.mesh.rays import RayCaster
from synfeal.planning.sampling import PoseVectors, pose_bounds, sample_poses
from synfeal.planning.target import admissible, has_free_view


@dataclass(frozen=True)
class PoseSpace:
    """The poses of one sampling box in a mesh."""

    caster: RayCaster  # rays against the mesh
    bounds: NDArray[np.float64]  # (2, 6) least and greatest value of each element of a pose vector
    min_view_distance_m: float  # least free view, the paper's ``d``
    rng: np.random.Generator  # where samples come from; each takes the next numbers

    @classmethod
    def of_scene(
        cls,
        caster: RayCaster,
        box_m: NDArray[np.float64],
        scene: SceneConfig,
        rng: np.random.Generator,
    ) -> Self:
        """Of a box (2, 3), with the angles and the view distance of a scene."""
        return cls(caster, pose_bounds(box_m, scene.angles), scene.min_view_distance_m, rng)

    def sample(self, count: int) -> PoseVectors:
        """Pose vectors (count, 6), uniform within the bounds."""
        return sample_poses(self.bounds, count, self.rng)

    def has_free_view(self, poses: PoseVectors) -> NDArray[np.bool_]:
        """Which poses (N, 6) look far enough, (N,)."""
        return has_free_view(self.caster, poses, self.min_view_distance_m)

    def admissible(self, start: PoseVectors, poses: PoseVectors) -> NDArray[np.bool_]:
        """Which candidates (N, 6) do so and are reached on a free line from ``start``, (N,)."""
        return admissible(self.caster, start, poses, self.min_view_distance_m)
