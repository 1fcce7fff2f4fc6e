"""Poses far from the origin, and alignments that have no single answer or a hard one."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.geometry import alignment, poses
from synfeal.hard_cases import exact
from synfeal.hard_cases.case import REFUSAL, REFUSED, Case, Trial
from synfeal.hard_cases.exact import MP, MPMATH

Array = NDArray[np.float64]
FAR_M = np.array([1e6, -7e5, 3e5])
SCALE, OFFSET_M = 0.37, np.array([5.0, -1.0, 2.0])


def motion_far_away() -> Trial:
    """Motion between two cameras decimetres apart, a thousand kilometres from the origin."""
    quats = [exact.rounded(exact.quat_of(angle, (1, 2, 3))) for angle in (0.4, 1.1)]
    a = poses.pose_from_quat(FAR_M + np.array([0.1, 0.2, 0.3]), quats[0])
    b = poses.pose_from_quat(FAR_M + np.array([0.35, 0.1, 0.7]), quats[1])
    offset = [exact.mpf(y) - exact.mpf(x) for x, y in zip(a[:3, 3], b[:3, 3], strict=True)]
    columns = exact.transposed(exact.exact(a[:3, :3]))
    return Trial(
        naive=lambda: (np.linalg.inv(a) @ b)[:3, 3],
        ours=lambda: poses.relative(a, b)[:3, 3],
        truth=[exact.dot(column, offset) for column in columns],
    )


def line(centre_m: Array, length_m: float) -> Array:
    """Centres (20, 3) on a straight line: the turn about it is free."""
    return centre_m + length_m * np.linspace(0.0, 1.0, 20)[:, None] * [0.3, -0.5, 0.81]


def flat() -> Array:
    """Centres (20, 3) in a plane through no axis."""
    rng = np.random.default_rng(0)
    plane = rng.normal(size=(20, 2)) @ np.array([[0.8, 0.6, 0.1], [-0.2, 0.3, 0.9]])
    return np.asarray(plane)


def cloud(centre_m: Array) -> Array:
    """Centres (20, 3) within a few metres of a point."""
    return np.asarray(centre_m + np.random.default_rng(1).normal(size=(20, 3)))


def undetermined(source: Array, target: Array | None = None) -> Trial:
    """Centres that leave the rotation free have no single alignment."""
    target = SCALE * source + OFFSET_M if target is None else target
    return Trial(
        naive=lambda: _without_checks(source, target),
        ours=lambda: _flat_similarity(alignment.umeyama_sim3(source, target)),
        truth=REFUSED,
    )


def aligned(source: Array, noise_m: float, outliers: float = 0.0) -> Trial:
    """Scale and rotation against the least-squares optimum found by Horn's quaternions."""
    rng = np.random.default_rng(2)
    turn = exact.rounded(exact.matrix_of(exact.quat_of(2, (1, -2, 2))))
    target = SCALE * (source - source.mean(axis=0)) @ turn.T + OFFSET_M
    target += noise_m * rng.normal(size=target.shape)
    wrong = rng.permutation(len(target))[: round(outliers * len(target))]
    target[wrong] += 5.0 * rng.normal(size=(len(wrong), 3))
    scale, rotation = _horn(source, target)
    return Trial(
        naive=lambda: _uncentred(source, target),
        ours=lambda: _flat_similarity(alignment.umeyama_sim3(source, target)),
        truth=[scale, *(value for row in rotation for value in row)],
    )


def _flat_similarity(found: tuple[float, Array, Array]) -> Array:
    """Scale and the elements of the rotation, (10,)."""
    return np.array([found[0], *found[1].ravel()])


def _without_checks(source: Array, target: Array) -> Array:
    """Arun's formula without a look at the rank or at reflections."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, _, vt = np.linalg.svd(b.T @ a)
    return np.array([np.sqrt((b**2).sum() / (a**2).sum()), *(u @ vt).ravel()])


def _uncentred(source: Array, target: Array) -> Array:
    """The same with covariances as means of products less products of means."""
    mean_a, mean_b = source.mean(axis=0), target.mean(axis=0)
    covariance = target.T @ source / len(source) - np.outer(mean_b, mean_a)
    u, singular, vt = np.linalg.svd(covariance)
    spread = (source**2).sum(axis=1).mean() - mean_a @ mean_a
    return np.array([singular.sum() / spread, *(u @ vt).ravel()])


def _horn(source: Array, target: Array) -> Any:
    """Least-squares scale and rotation: Horn (1987), by the largest eigenvalue of 4x4 moments.

    Another method than the one it judges, which takes singular values.
    """
    a, b = (_centred(points) for points in (source, target))
    m = [[exact.dot([p[i] for p in a], [q[j] for q in b]) for j in range(3)] for i in range(3)]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = m
    moments = MP.matrix(
        [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, yy - xx - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, zz - xx - yy],
        ]
    )
    values, vectors = MP.eigsy(moments)
    rotation = exact.matrix_of(exact.unit(list(vectors[:, 3])))
    return values[3] / sum(exact.dot(p, p) for p in a), rotation


def _centred(points: Array) -> Any:
    columns = exact.transposed(exact.exact(points))
    means = [sum(column) / len(column) for column in columns]
    return [[x - m for x, m in zip(exact.exact(p), means, strict=True)] for p in points]


_ALIGN = partial(Case, "alignment (Sim(3))", ours="umeyama_sim3")
_REFUSE = partial(
    _ALIGN,
    quantity=REFUSAL,
    unit="1",
    naive="Arun, no rank test",
    reference="by construction",
    bound=0.0,
)
_SCALE = partial(
    _ALIGN,
    quantity="scale and elements of R",
    unit="1",
    naive="Arun, E[xy] − E[x] E[y]",
    reference="Horn, " + MPMATH,
)
ORIGIN = np.zeros(3)

CASES = (
    Case(
        "relative pose",
        "cameras 1e6 m from the origin",
        "position",
        "m",
        "inverse(a) · b",
        "relative",
        MPMATH,
        1e-15,
        motion_far_away,
    ),
    _REFUSE("coincident centres", trial=lambda: undetermined(np.tile(FAR_M, (20, 1)))),
    _REFUSE("collinear centres", trial=lambda: undetermined(line(ORIGIN, 2.0))),
    _REFUSE("0.1 m of a line, 1e6 m away", trial=lambda: undetermined(line(FAR_M, 0.1))),
    _REFUSE(
        "centres aligned to a line", trial=lambda: undetermined(cloud(ORIGIN), line(ORIGIN, 2.0))
    ),
    _SCALE("coplanar centres", bound=1e-14, trial=lambda: aligned(flat(), 0.05)),
    _SCALE("centres 1e6 m away", bound=1e-12, trial=lambda: aligned(cloud(FAR_M), 0.01)),
    _SCALE(
        "30 % outliers: still the least squares, no more",
        bound=1e-13,
        trial=lambda: aligned(cloud(ORIGIN), 0.01, 0.3),
    ),
)
