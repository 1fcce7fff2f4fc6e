"""What a planner asks a mesh: the decisions a collision mesh must not change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import SceneConfig
from synfeal.mesh.rays import RayCaster
from synfeal.planning.sampling import PoseVectors
from synfeal.planning.space import PoseSpace
from synfeal.planning.start import sample_start
from synfeal.planning.target import admissible

N_QUESTIONS = 10_000
RAYS_EACH = 2  # one to the candidate, one along its optical axis
N_MOVES = 12  # after these a walk no longer remembers where it began
MAX_TRIES = 2000


@dataclass(frozen=True)
class Questions:
    """Candidates (N, 6), each to be judged from a start of its own (N, 6)."""

    starts: PoseVectors
    candidates: PoseVectors
    min_view_distance_m: float

    @property
    def n_rays(self) -> int:
        """Rays cast to answer all of them."""
        return RAYS_EACH * len(self.candidates)

    def answers(self, caster: RayCaster) -> NDArray[np.bool_]:
        """Which candidates (N,) are admissible in the mesh of ``caster``."""
        return admissible(caster, self.starts, self.candidates, self.min_view_distance_m)


def draw_questions(
    caster: RayCaster,  # rays against the undecimated mesh
    scene: SceneConfig,  # angle bounds and least view distance
    box_m: NDArray[np.float64],  # (2, 3) lower and upper corner of the space that is sampled
    rng: np.random.Generator,  # the only source of randomness
    # number of questions; all are independent of each other but for the first pose
    count: int = N_QUESTIONS,
) -> Questions:
    """Questions that planners of a scene would ask: the last candidates of ``count`` short walks.

    Each walk leaves the planner's first pose and goes to every admissible candidate it draws, so a
    start is always an admissible pose: no question starts in a cupboard or outside the room.
    """
    space = PoseSpace.of_scene(caster, box_m, scene, rng)
    starts = np.tile(sample_start(space, MAX_TRIES), (count, 1))
    for _ in range(N_MOVES):
        candidates = space.sample(count)
        moves = space.admissible(starts, candidates)
        starts[moves] = candidates[moves]
    return Questions(starts, space.sample(count), scene.min_view_distance_m)
