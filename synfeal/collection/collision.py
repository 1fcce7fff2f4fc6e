"""Choice of a collision mesh: the fewest triangles that keep the planner's answers (sec. 3.2).

Smaller meshes are made one from the other, down a ladder of face counts, and each answers the
questions a planner asks of the scene. The full mesh's answers are the truth; the smallest mesh
that agrees with it, as all larger ones do, is taken.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from synfeal.config.collection import SceneConfig
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, merge_vertices, simplify
from synfeal.planning.space import Questions, draw_questions
from synfeal.records.tables import write_numbers
from synfeal.records.timing import seconds_of

SMALLEST = 100
N_BISECTIONS = 4  # between two rungs, a factor of 2: the count is then settled to 4 %
N_TIMINGS = 3

log = logging.getLogger("synfeal")


@dataclass(frozen=True)
class Rung:
    """Measured cost and agreement of one face count; a line of the curve."""

    faces: int  # triangles of the mesh
    agreement: float  # share of decisions equal to the full mesh's
    agreement_low: float  # its 95 % limits (Wilson)
    agreement_high: float  # its 95 % limits (Wilson)
    wrongly_admitted: int  # candidates only this mesh admits; a camera would pass a surface
    wrongly_refused: int  # candidates only the full mesh admits
    rays_per_s: int  # rays answered per second within those decisions, median of several runs
    full_rays_per_s: int  # the same of the full mesh, in turns with this one
    build_s: float  # time simplification took, from the full mesh on
    chosen: int = 0  # 1 for the mesh that is used, else 0


CURVE_HEADER = ",".join(field.name for field in fields(Rung))


@dataclass(frozen=True)
class Reference:
    """The full mesh, the questions a planner asks of it, and its answers."""

    caster: RayCaster
    questions: Questions
    answers: NDArray[np.bool_]


@dataclass(frozen=True)
class Trial:
    """A mesh and what was measured of it."""

    mesh: Triangles
    rung: Rung


def collision_mesh(
    mesh: TexturedMesh,
    scene: SceneConfig,
    box_m: NDArray[np.float64],
    min_agreement: float,
    rng: np.random.Generator,
) -> tuple[Triangles, list[Rung]]:
    """Find the smallest mesh on which a planner decides as on ``mesh``, and record the search.

    Alpha-tested surfaces block as a whole: a camera does not fly through foliage.

    Args:
        mesh: Mesh of the scene.
        scene: Angle bounds and least view distance of its poses.
        box_m: Lower and upper corner (2, 3) of the sampling box, world, metres.
        min_agreement: Least share of decisions, 0 to 1, that must equal those on the full mesh.
        rng: Draws the questions, see :func:`synfeal.planning.space.draw_questions`.

    Returns:
        The collision mesh, and the rungs of the search from the full mesh down.
    """
    full = merge_vertices(*mesh.merged())
    questions = draw_questions(RayCaster(*full), scene, box_m, rng)
    trials = search(full, questions, min_agreement)
    curve = [trial.rung for trial in trials]
    chosen = next(trial for trial in trials if trial.rung.chosen)
    log.info(
        "collision mesh: %d of %d faces, %.2f %% of %d decisions agree",
        chosen.rung.faces,
        len(full.faces),
        100 * chosen.rung.agreement,
        len(questions.candidates),
    )
    return chosen.mesh, curve


def search(full: Triangles, questions: Questions, min_agreement: float) -> list[Trial]:
    """Search for the smallest mesh on which decisions agree with those on the full mesh.

    Args:
        full: The full mesh.
        questions: Questions that every mesh answers.
        min_agreement: Least share of answers, 0 to 1, that must equal those on the full mesh.

    Returns:
        All meshes that were measured, from the full one to the smallest; ``chosen`` is 1 in the
        rung of the smallest that agrees, as all larger ones do.
    """
    caster = RayCaster(*full)
    reference = Reference(caster, questions, questions.answers(caster))
    trials = [measure(full, reference, 0.0)]
    for n_faces in ladder(len(full.faces)):
        smaller = next_trial(trials[-1], n_faces, reference)
        if smaller.rung.faces == trials[-1].rung.faces:  # no edge is left that may collapse
            break
        trials.append(smaller)
    for _ in range(N_BISECTIONS):
        last = last_agreeing([trial.rung for trial in trials], min_agreement)
        if last + 1 == len(trials):
            break
        measured = trials[last].rung.faces, trials[last + 1].rung.faces
        between = round(np.sqrt(measured[0] * measured[1]))
        if between in measured:
            break
        trial = next_trial(trials[last], between, reference)
        if trial.rung.faces in measured:  # simplification has no step in between
            break
        trials.insert(last + 1, trial)
    chosen = last_agreeing([trial.rung for trial in trials], min_agreement)
    trials[chosen] = Trial(trials[chosen].mesh, replace(trials[chosen].rung, chosen=1))
    return trials


def ladder(n_faces: int) -> list[int]:
    """List face counts below ``n_faces`` from the largest down, each twice the next."""
    counts = [SMALLEST]
    while 2 * counts[-1] < n_faces:
        counts.append(2 * counts[-1])
    return [count for count in reversed(counts) if count < n_faces]


def last_agreeing(rungs: Sequence[Rung], min_agreement: float) -> int:
    """Return the index of the smallest mesh that agrees, as all larger ones do; 0 always does."""
    agree = [rung.agreement >= min_agreement for rung in rungs]
    return agree.index(False) - 1 if False in agree else len(rungs) - 1


def next_trial(larger: Trial, n_faces: int, reference: Reference) -> Trial:
    """Simplify a mesh further and measure the result.

    Args:
        larger: Trial whose mesh is simplified.
        n_faces: Number of triangles to reach.
        reference: The full mesh and its answers.
    """
    begin = time.perf_counter()
    mesh = simplify(larger.mesh, n_faces)
    build_s = larger.rung.build_s + time.perf_counter() - begin
    return measure(mesh, reference, build_s)


def measure(mesh: Triangles, reference: Reference, build_s: float) -> Trial:
    """Compare the answers of a mesh with those of the full one, and their speed.

    Args:
        mesh: Mesh to judge.
        reference: The full mesh and its answers.
        build_s: Seconds that simplifying it took.
    """
    caster, expected = RayCaster(*mesh), reference.answers
    found = reference.questions.answers(caster)
    n_equal = int(np.sum(expected == found))
    limits = binomtest(n_equal, len(expected)).proportion_ci(0.95, method="wilson")
    speed, full_speed = rays_per_s(reference.questions, caster, reference.caster)
    rung = Rung(
        faces=len(mesh.faces),
        agreement=n_equal / len(expected),
        agreement_low=round(float(limits.low), 6),
        agreement_high=round(float(limits.high), 6),
        wrongly_admitted=int(np.sum(found & ~expected)),
        wrongly_refused=int(np.sum(expected & ~found)),
        rays_per_s=speed,
        full_rays_per_s=full_speed,
        build_s=round(build_s, 3),
    )
    return Trial(mesh, rung)


def rays_per_s(questions: Questions, *casters: RayCaster) -> list[int]:
    """Time casters at the same questions in turns, so that other load slows all of them alike."""
    works = [partial(questions.answers, caster) for caster in casters]
    seconds = np.array([seconds_of(works) for _ in range(N_TIMINGS)])
    return [round(questions.n_rays / median) for median in np.median(seconds, axis=0)]


def write_curve(path: Path, curve: Sequence[Rung]) -> None:
    """Write one line per face count, the largest first; speeds and times differ between runs."""
    write_numbers(path, CURVE_HEADER, map(astuple, curve))
