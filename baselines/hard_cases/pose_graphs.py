"""Pose graphs with bad starts, edges twice, information of all sizes, and parts without an edge."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import partial

import gtsam
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from baselines.groundtruth.posegraph import lm, optimise, toro
from baselines.groundtruth.posegraph.graph import Edge, PoseGraph, swapped_blocks
from synfeal.config.models import PoseGraphConfig
from synfeal.geometry.poses import pose_matrix, relative
from synfeal.hard_cases.case import REFUSAL, REFUSED, Case, Trial
from synfeal.hard_cases.exact import RATIONAL, exact

Array = NDArray[np.float64]
N_NODES, N_TURNS = 60, 3


def optimised(name: str, graph: PoseGraph) -> Array:
    """Positions (n, 3) by an optimiser, given more than enough iterations."""
    if name == "lm":
        return lm.optimise_lm(graph, 100)[:, :3, 3]
    return toro.optimise_toro(graph, 600, 1e-12)[:, :3, 3]


def spiral() -> tuple[Array, PoseGraph]:
    """Poses (60, 4, 4) on three turns of a spiral stair, and the graph of their exact motions.

    A node is joined to the next and to the one a turn below.
    """
    angle = 2.0 * np.pi * N_TURNS * np.arange(N_NODES) / N_NODES
    rotation = Rotation.from_euler("z", angle[:, None]).as_matrix()
    position_m = np.column_stack([3.0 * np.cos(angle), 3.0 * np.sin(angle), 0.3 * angle])
    world = pose_matrix(rotation, position_m)
    truth = relative(world[0], world)
    below = N_NODES // N_TURNS
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
    return _against_gauss_newton(name, truth, PoseGraph(start, graph.edges))


def uneven(name: str) -> Trial:
    """Information between 1e-6 and 1e6 from edge to edge; the start is 1 cm off."""
    truth, graph = spiral()
    rng = np.random.default_rng(2)
    scale = 10.0 ** rng.uniform(-6.0, 6.0, len(graph.edges))
    edges = tuple(
        replace(edge, information=s * np.eye(6)) for edge, s in zip(graph.edges, scale, strict=True)
    )
    start = truth.copy()
    start[1:, :3, 3] += 0.01 * rng.normal(size=(N_NODES - 1, 3))
    return _against_gauss_newton(name, truth, PoseGraph(start, edges))


def edge_twice(name: str) -> Trial:
    """Measured twice at 1 m and once at 2 m: 4/3 m."""
    near, far = pose_matrix(np.eye(3), [1.0, 0, 0]), pose_matrix(np.eye(3), [2.0, 0, 0])
    edges = tuple(Edge(0, 1, motion, 1e4 * np.eye(6)) for motion in (near, near, far))
    graph = PoseGraph(np.array([np.eye(4), near]), edges)
    last = PoseGraph(graph.first_from_cam, tuple({(e.i, e.j): e for e in edges}.values()))
    return Trial(
        naive=lambda: optimised(name, last)[1, 0],
        ours=lambda: optimised(name, graph)[1, 0],
        truth=Fraction(4, 3),
    )


def in_two_parts(name: str) -> Trial:
    """Nodes that no chain of edges joins to the first have no pose to be found."""
    edges = (Edge(0, 1, np.eye(4), np.eye(6)), Edge(2, 3, np.eye(4), np.eye(6)))
    graph = PoseGraph(np.tile(np.eye(4), (4, 1, 1)), edges)
    return Trial(
        naive=lambda: graph.first_from_cam,
        ours=lambda: optimise.optimise(name, graph, PoseGraphConfig()).first_from_cam,
        truth=REFUSED,
    )


def gauss_newton(graph: PoseGraph) -> Array:
    """Positions (n, 3) by Gauss-Newton: every step taken as it comes."""
    factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for node, pose in enumerate(graph.first_from_cam):
        values.insert(node, gtsam.Pose3(pose))
    factors.add(gtsam.PriorFactorPose3(0, gtsam.Pose3(), gtsam.noiseModel.Isotropic.Sigma(6, 1e-9)))
    for edge in graph.edges:
        noise = gtsam.noiseModel.Gaussian.Information(swapped_blocks(edge.information))
        factors.add(gtsam.BetweenFactorPose3(edge.i, edge.j, gtsam.Pose3(edge.i_from_j), noise))
    result = gtsam.GaussNewtonOptimizer(factors, values, gtsam.GaussNewtonParams()).optimize()
    return np.array([result.atPose3(node).translation() for node in range(len(graph))])


def _against_gauss_newton(name: str, truth: Array, graph: PoseGraph) -> Trial:
    return Trial(
        naive=lambda: gauss_newton(graph),
        ours=lambda: optimised(name, graph),
        truth=exact(truth[:, :3, 3]),
    )


_GRAPH = partial(
    Case,
    "pose graphs",
    quantity="position",
    unit="m",
    naive="Gauss-Newton",
    reference="poses the edges were made of",
)


def _cases(name: str, title: str, bound_m: float, twice_m: float) -> tuple[Case, ...]:
    """The same graphs for each optimiser; ``twice_m`` is what a descent that cools down reaches."""
    graph = partial(_GRAPH, ours=f"optimise_{name}")
    return (
        graph(f"{title}: a third 170° off", bound=bound_m, trial=partial(turned, name)),
        graph(f"{title}: information 1e-6 to 1e6", bound=bound_m, trial=partial(uneven, name)),
        graph(
            f"{title}: an edge twice",
            naive="one edge per pair of nodes",
            reference=RATIONAL,
            bound=twice_m,
            trial=partial(edge_twice, name),
        ),
        graph(
            f"{title}: two parts",
            quantity=REFUSAL,
            unit="1",
            ours="optimise",
            naive="no test",
            reference="by construction",
            bound=0.0,
            trial=partial(in_two_parts, name if name == "toro" else "g2o"),
        ),
    )


CASES = (*_cases("lm", "LM", 1e-9, 1e-9), *_cases("toro", "TORO", 1e-6, 0.02))
