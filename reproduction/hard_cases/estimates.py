"""Injected noise, pose graphs with bad starts or parts, medians of infinite values, rare shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import comb, inf, sqrt
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import kstest, norm

from baselines.config.labels import PoseGraphConfig
from baselines.labels import injected as labels
from baselines.labels.methods import solve_graph
from baselines.labels.posegraph import optimise, toro
from baselines.labels.posegraph.graph import Edge, PoseGraph
from reproduction.hard_cases.exact import REFUSED, Trial, exact, mpf
from reproduction.statistics import limits as stats
from synfeal.dataset.pose_table import PoseTable
from synfeal.evaluation import bootstrap
from synfeal.geometry.poses import pose_matrix, relative
from synfeal.geometry.rotations import rotation_angle_rad

Array = NDArray[np.float64]
N_NODES, N_TURNS = 60, 3
OPTIMISERS = {  # positions (n, 3), given more than enough iterations
    "lm": lambda graph: optimise.optimise_lm(graph, 100)[:, :3, 3],
    "toro": lambda graph: toro.optimise_toro(graph, 600, 1e-12)[:, :3, 3],
}


def spiral() -> tuple[Array, PoseGraph]:
    """Poses (60, 4, 4) on three turns of a spiral stair, and the graph of their exact motions.

    A node is joined to the next and to the one a turn below.
    """
    angle = 2.0 * np.pi * N_TURNS * np.arange(N_NODES) / N_NODES
    rotation = Rotation.from_euler("z", angle[:, None]).as_matrix()
    position_m = np.column_stack([3.0 * np.cos(angle), 3.0 * np.sin(angle), 0.3 * angle])
    world = pose_matrix(rotation, position_m)
    truth, below = relative(world[0], world), N_NODES // N_TURNS
    pairs = [(k, k + 1) for k in range(N_NODES - 1)]
    pairs += [(k, k + below) for k in range(N_NODES - below)]
    edges = tuple(Edge(i, j, relative(truth[i], truth[j]), 1e4 * np.eye(6)) for i, j in pairs)
    return truth, PoseGraph(truth, edges)


def turned(name: str) -> Trial:
    """The last third starts 170 degrees and about half a metre off; true poses cost nothing."""
    truth, graph = spiral()
    turn = Rotation.from_euler("z", 170.0, degrees=True).as_matrix()
    shift = 0.3 * np.random.default_rng(1).normal(size=(N_NODES - 40, 3))
    start = truth.copy()
    start[40:] = start[40:] @ pose_matrix(np.tile(turn, (N_NODES - 40, 1, 1)), shift)
    graph = PoseGraph(start, graph.edges)
    return Trial(
        naive=lambda: gauss_newton(graph),
        ours=lambda: OPTIMISERS[name](graph),
        truth=exact(truth[:, :3, 3]),
    )


def gauss_newton(graph: PoseGraph) -> Array:
    """Positions (n, 3) by Gauss-Newton: every step taken as it comes."""
    optimizer = gtsam.GaussNewtonOptimizer(*optimise.factors_of(graph), gtsam.GaussNewtonParams())
    result = optimizer.optimize()
    return np.array([result.atPose3(node).translation() for node in range(len(graph))])


def edge_twice(name: str) -> Trial:
    """Measured twice at 1 m and once at 2 m: 4/3 m."""
    near, far = pose_matrix(np.eye(3), [1.0, 0, 0]), pose_matrix(np.eye(3), [2.0, 0, 0])
    edges = tuple(Edge(0, 1, motion, 1e4 * np.eye(6)) for motion in (near, near, far))
    graph = PoseGraph(np.array([np.eye(4), near]), edges)
    last = PoseGraph(graph.first_from_cam, tuple({(e.i, e.j): e for e in edges}.values()))
    return Trial(
        naive=lambda: OPTIMISERS[name](last)[1, 0],
        ours=lambda: OPTIMISERS[name](graph)[1, 0],
        truth=Fraction(4, 3),
    )


def in_two_parts(method: str) -> Trial:
    """Nodes that no chain of edges joins to the first have no pose to be found."""
    edges = (Edge(0, 1, np.eye(4), np.eye(6)), Edge(2, 3, np.eye(4), np.eye(6)))
    graph = PoseGraph(np.tile(np.eye(4), (4, 1, 1)), edges)
    return Trial(
        naive=lambda: graph.first_from_cam,
        ours=lambda: solve_graph(f"rgbd-{method}", graph, PoseGraphConfig())[0].first_from_cam,
        truth=REFUSED,
    )


def median_of(values: Sequence[float], counts: Sequence[int] | None = None) -> Trial:
    """Median of values, each taken as often as ``counts`` says (once, when absent)."""
    taken = np.repeat(values, counts or [1] * len(values))
    ranked = sorted(taken.tolist())
    low, high = ranked[(len(ranked) - 1) // 2], ranked[len(ranked) // 2]
    drawn = np.array([counts or [1] * len(values)])
    return Trial(
        naive=lambda: np.quantile(taken, 0.5),
        ours=lambda: bootstrap.medians(np.array(values), np.arange(len(values)), drawn)[0],
        truth=inf if high == inf else (Fraction(low) + Fraction(high)) / 2,
    )


def limits_of(drawn: Sequence[float]) -> Trial:
    """95 % limits of resamples: the values with 2.5 % of them beyond."""
    ranked, beyond = sorted(drawn), len(drawn) * 25 // 1000
    return Trial(
        naive=lambda: np.quantile(drawn, [0.025, 0.975]),
        ours=lambda: np.array(bootstrap.limits(np.array([0.0, *drawn]))),
        truth=[ranked[beyond], ranked[-1 - beyond]],
    )


def share(count: int, total: int) -> Trial:
    """95 % limits of ``count`` of ``total``: where a tail of the binomial holds exactly 2.5 %."""
    return Trial(
        naive=lambda: wald(count, total),
        ours=lambda: np.array(stats.share_limits(count, total)),
        truth=[_limit(count, total), 1 - _limit(total - count, total)],
    )


def wald(count: int, total: int) -> Array:
    """Limits of a normal distribution."""
    observed = count / total
    half = float(norm.ppf(0.975)) * sqrt(observed * (1.0 - observed) / total)
    return np.array([observed - half, observed + half])


def _limit(count: int, total: int) -> Any:
    """The share at which ``count`` or more of ``total`` have a chance of 2.5 %, by bisection."""
    low, high = mpf(0.0), mpf(1.0)
    for _ in range(170):  # 2^-170 < 1e-50
        middle = (low + high) / 2
        fewer = sum(comb(total, k) * middle**k * (1 - middle) ** (total - k) for k in range(count))
        low, high = (middle, high) if 1 - fewer < mpf(Fraction(1, 40)) else (low, middle)
    return low if count else mpf(0.0)


def signs(negative: int, positive: int) -> Trial:
    """Probability of a split at least as uneven, from counts of equally likely signs."""
    total = negative + positive
    tail = sum(comb(total, k) for k in range(min(negative, positive) + 1))
    changes = [-1.0] * negative + [1.0] * positive
    return Trial(
        naive=lambda: 2.0 * norm.sf(abs(negative - positive) / sqrt(total)),
        ours=lambda: stats.sign_test(changes)[2],
        truth=min(Fraction(1), Fraction(2 * tail, 2**total)),
    )


N_POSES, NOISE_M = 20_000, 0.3
# Kolmogorov's distance that one uniform sample in a thousand exceeds, shared by three coordinates.
LARGEST_DISTANCE = float(np.sqrt(-0.5 * np.log(0.001 / 3 / 2) / N_POSES))


@cache
def clean() -> PoseTable:
    """Random poses."""
    rng = np.random.default_rng(7)
    quat = Rotation.random(N_POSES, rng=rng).as_quat(canonical=True, scalar_first=True)
    return PoseTable(np.arange(N_POSES), np.arange(N_POSES), rng.normal(size=(N_POSES, 3)), quat)


def _noisy(noise_m: float, noise_deg: float) -> PoseTable:
    return labels.add_noise(clean(), noise_m, noise_deg, np.random.default_rng(8))


def _published_turns(noise_deg: float) -> PoseTable:
    """Orientations turned as the published code does it: +-nominal / sqrt(3) on every angle."""
    signs = np.random.default_rng(2).choice([-1.0, 1.0], (N_POSES, 3))
    turn = Rotation.from_euler("xyz", noise_deg / np.sqrt(3.0) * signs, degrees=True)
    turned = turn * Rotation.from_quat(clean().quat_wxyz, scalar_first=True)
    return replace(clean(), quat_wxyz=turned.as_quat(canonical=True, scalar_first=True))


def median_displacement() -> Trial:
    """Median displacement as a share of the nominal one; the published code's is sqrt(3) times."""
    step = np.random.default_rng(1).normal(size=(N_POSES, 3))
    step *= np.sqrt(3.0) / np.linalg.norm(step, axis=1, keepdims=True)

    def ours() -> Any:
        moved_m = _noisy(NOISE_M, 0.0).position_m - clean().position_m
        return np.median(np.linalg.norm(moved_m, axis=1)) / NOISE_M

    return Trial(lambda: np.median(np.linalg.norm(step, axis=1)), ours, truth=mpf(1.0))


def median_turn(noise_deg: float) -> Trial:
    """Median geodesic angle as a share of the nominal one."""

    def share(noisy: PoseTable) -> Any:
        angles = rotation_angle_rad(clean().quat_wxyz, noisy.quat_wxyz)
        return np.median(np.degrees(angles)) / noise_deg

    return Trial(
        naive=lambda: share(_published_turns(noise_deg)),
        ours=lambda: share(_noisy(0.0, noise_deg)),
        truth=mpf(1.0),
    )


def directions_of_axes() -> Trial:
    """Axes of turns: how far their coordinates are from uniform on [-1, 1] (Archimedes)."""

    def distance(noisy: PoseTable) -> float:
        before, after = (
            Rotation.from_quat(t.quat_wxyz, scalar_first=True) for t in (clean(), noisy)
        )
        vectors = (after * before.inv()).as_rotvec()
        unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
        found = [kstest(column, "uniform", (-1.0, 2.0), method="asymp") for column in unit.T]
        return max(float(result.statistic) for result in found)

    return Trial(
        naive=lambda: distance(_published_turns(20.0)),
        ours=lambda: distance(_noisy(0.0, 20.0)),
        truth=mpf(0.0),
    )
