"""Inputs of hard cases about labels and statistics: noisy poses, pose graphs."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from baselines.config.labels import PoseGraphConfig
from baselines.labels import injected
from baselines.labels.methods import solve_graph
from baselines.labels.posegraph import levenberg_marquardt, toro
from baselines.labels.posegraph.graph import Edge, PoseGraph
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_matrix, relative
from synfeal.geometry.rotations import rotation_angle_rad

Array = NDArray[np.float64]
N_NODES, N_TURNS, N_TURNED = 60, 3, 20
INFORMATION = 1e4 * np.eye(6)
N_POSES, NOISE_M, NOISE_DEG = 20_000, 0.3, 20.0
# Kolmogorov's distance that one uniform sample in a thousand exceeds, shared by three coordinates.
LARGEST_DISTANCE = float(np.sqrt(-0.5 * np.log(0.001 / 3 / 2) / N_POSES))


def spiral() -> tuple[Array, PoseGraph]:
    """Make poses (60, 4, 4) on three turns of a spiral stair, and the graph of their exact motions.

    A node is joined to the next and to the one a turn below.
    """
    angle = 2.0 * np.pi * N_TURNS * np.arange(N_NODES) / N_NODES
    rotation = Rotation.from_euler("z", angle[:, None]).as_matrix()
    position_m = np.column_stack([3.0 * np.cos(angle), 3.0 * np.sin(angle), 0.3 * angle])
    world = pose_matrix(rotation, position_m)
    truth, below = relative(world[0], world), N_NODES // N_TURNS
    pairs = [(k, k + 1) for k in range(N_NODES - 1)]
    pairs += [(k, k + below) for k in range(N_NODES - below)]
    edges = tuple(Edge(i, j, relative(truth[i], truth[j]), INFORMATION) for i, j in pairs)
    return truth, PoseGraph(truth, edges)


def turned_spiral() -> PoseGraph:
    """Turn the start of the spiral's last third by 170 degrees and move it by half a metre."""
    truth, graph = spiral()
    turn = Rotation.from_euler("z", 170.0, degrees=True).as_matrix()
    shift = 0.3 * np.random.default_rng(1).normal(size=(N_TURNED, 3))
    start = truth.copy()
    start[-N_TURNED:] = start[-N_TURNED:] @ pose_matrix(np.tile(turn, (N_TURNED, 1, 1)), shift)
    return PoseGraph(start, graph.edges)


def spiral_error_m(first_from_cam: Array) -> float:
    """Return the largest coordinate error of positions on the spiral."""
    return float(np.abs(first_from_cam[:, :3, 3] - spiral()[0][:, :3, 3]).max())


def doubled_edge() -> PoseGraph:
    """Measure one motion twice at 1 m and once at 2 m: 4/3 m."""
    near, far = pose_matrix(np.eye(3), [1.0, 0, 0]), pose_matrix(np.eye(3), [2.0, 0, 0])
    edges = tuple(Edge(0, 1, motion, INFORMATION) for motion in (near, near, far))
    return PoseGraph(np.array([np.eye(4), near]), edges)


def two_parts() -> PoseGraph:
    """Leave two nodes that no chain of edges joins to the first."""
    edges = (Edge(0, 1, np.eye(4), np.eye(6)), Edge(2, 3, np.eye(4), np.eye(6)))
    return PoseGraph(np.tile(np.eye(4), (4, 1, 1)), edges)


def by_lm(graph: PoseGraph) -> Array:
    """Optimise with more than enough iterations of Levenberg-Marquardt: poses (N, 4, 4)."""
    return levenberg_marquardt.optimise_lm(graph, 100)


def by_toro(graph: PoseGraph) -> Array:
    """Optimise with more than enough iterations of TORO: poses (N, 4, 4)."""
    return toro.optimise_toro(graph, 600, 1e-12)


def optimised(method: str, graph: PoseGraph) -> Array:
    """Optimise as a label method does, ``rgbd-g2o`` or ``rgbd-toro``: poses (N, 4, 4)."""
    return solve_graph(method, graph, PoseGraphConfig())[0].first_from_cam


@cache
def clean_poses() -> PoseTable:
    """Draw random poses."""
    rng = np.random.default_rng(7)
    quat = Rotation.random(N_POSES, rng=rng).as_quat(canonical=True, scalar_first=True)
    return PoseTable(np.arange(N_POSES), np.arange(N_POSES), rng.normal(size=(N_POSES, 3)), quat)


def noisy_poses(noise_m: float, noise_deg: float) -> PoseTable:
    """Add the project's noise to the random poses."""
    return injected.add_noise(clean_poses(), noise_m, noise_deg, np.random.default_rng(8))


def displacement_share(noisy: PoseTable) -> float:
    """Return the median displacement as a share of the nominal one."""
    moved_m = noisy.position_m - clean_poses().position_m
    return float(np.median(np.linalg.norm(moved_m, axis=1)) / NOISE_M)


def turn_share(noisy: PoseTable) -> float:
    """Return the median geodesic angle as a share of the nominal one."""
    angles = rotation_angle_rad(clean_poses().quat_wxyz, noisy.quat_wxyz)
    return float(np.median(np.degrees(angles)) / NOISE_DEG)


def distance_from_uniform(noisy: PoseTable) -> float:
    """Return how far coordinates of turn axes are from uniform on [-1, 1] (Archimedes)."""
    before, after = (
        Rotation.from_quat(t.quat_wxyz, scalar_first=True) for t in (clean_poses(), noisy)
    )
    vectors = (after * before.inv()).as_rotvec()
    unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    found = [kstest(column, "uniform", (-1.0, 2.0), method="asymp") for column in unit.T]
    return max(float(result.statistic) for result in found)
