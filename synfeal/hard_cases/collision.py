"""Thin walls in a collision mesh: what is chosen for its decisions, and what for its size."""

from __future__ import annotations

from functools import cache

import numpy as np
import trimesh

from synfeal.config.models import SceneConfig
from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import mpf
from synfeal.mesh import collision
from synfeal.mesh.decimate import simplify
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, merge_vertices
from synfeal.planning.questions import Questions, draw_questions

SCENE = SceneConfig.model_validate({"source": "mesh", "path": "room.glb"})
SPACE_M = np.array([[-2.8, -1.8, 0.8], [2.8, 1.8, 1.8]])
MIN_AGREEMENT = 0.995
FIXED_FACES = 100
N_ASKED, N_FRESH = 2000, 4000


@cache
def thin_walls() -> Triangles:
    """A room of 6 m with three screens of 5 mm, an open column of sheets and balls lying about."""
    parts = [_divided([[-3.0, -2.0, 0.0], [3.0, 2.0, 2.5]], 4)]
    for x, low, high in ((-1.5, -2.0, 0.5), (0.0, -0.5, 2.0), (1.5, -2.0, 0.5)):
        parts.append(_divided([[x, low, 0.0], [x + 0.005, high, 2.2]], 3))
    column = trimesh.creation.box(bounds=[[-0.9, 0.8, 0.0], [-0.5, 1.2, 2.5]])
    parts.append(
        trimesh.Trimesh(column.vertices, column.faces[column.face_normals[:, 2] ** 2 < 0.5])
    )
    for centre in np.random.default_rng(0).uniform([-2.7, -1.7, 0.2], [2.7, 1.7, 0.6], (8, 3)):
        ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
        parts.append(ball.apply_translation(centre))
    joined = trimesh.util.concatenate(parts)
    return merge_vertices(np.asarray(joined.vertices), np.asarray(joined.faces))


def wrong_decisions() -> Trial:
    """Share of decisions that are not the full mesh's, on questions the choice did not see."""
    full = thin_walls()
    reference = RayCaster(*full)
    asked, fresh = (_questions(reference, seed, n) for seed, n in ((1, N_ASKED), (2, N_FRESH)))
    expected = fresh.answers(reference)

    def wrong(mesh: Triangles) -> float:
        return float(np.mean(fresh.answers(RayCaster(*mesh)) != expected))

    def chosen() -> Triangles:
        trials = collision.search(full, asked, MIN_AGREEMENT)
        return next(trial.mesh for trial in trials if trial.rung.chosen)

    return Trial(
        naive=lambda: wrong(simplify(full, FIXED_FACES)),
        ours=lambda: wrong(chosen()),
        truth=mpf(0.0),
    )


def _questions(caster: RayCaster, seed: int, count: int) -> Questions:
    return draw_questions(caster, SCENE, SPACE_M, np.random.default_rng(seed), count)


def _divided(bounds: list[list[float]], times: int) -> trimesh.Trimesh:
    box = trimesh.creation.box(bounds=bounds)
    for _ in range(times):
        box = box.subdivide()
    return box


# What 2,000 questions leave open of a share of 0.5 %: three standard deviations.
SLACK = 3.0 * np.sqrt(MIN_AGREEMENT * (1.0 - MIN_AGREEMENT) / N_ASKED)

CASES = (
    Case(
        family="collision mesh",
        name="screens of 5 mm",
        quantity="wrong decisions",
        unit="share",
        naive=f"decimation to {FIXED_FACES} faces",
        ours="search",
        reference="full mesh",
        bound=round(float(1.0 - MIN_AGREEMENT + SLACK), 4),
        trial=wrong_decisions,
    ),
)
