"""The TORO row: stochastic gradient descent on a tree parameterisation of the pose graph.

Written from Olson, Leonard and Teller, "Fast iterative alignment of pose graphs with poor initial
estimates" (ICRA 2006), Grisetti et al., "A tree parameterization for efficiently computing maximum
likelihood maps using gradient descent" (RSS 2007), and Grisetti, Stachniss and Burgard, "Nonlinear
constraint network optimization for efficient map learning" (T-ITS 2009), which takes it to 3D.

Parameters. Each node but the first has a parent, the lowest-numbered node it shares an edge with,
and is described by ``parent_from_node``. An edge (i, j) touches only the nodes on its path in the
tree, from i up to the lowest common ancestor and down to j.

Update. Along the path let ``G_k = i_from_(k-th node)``, k = 0..L. With the measured motion Z:

    rotation      B = R_Z R(G_L)^T;        R(G_k) <- slerp(I, B, g_r u_k) R(G_k)
    translation   d = t_Z - t(G_L);        t(G_k) <- t(G_k) + g_t v_k d

where the translation residual is taken after the rotations have been changed. The cumulative
weights

    u_k = sum_(m <= k) 1/M_m / sum_(m <= L) 1/M_m,     M_m = sum of w_e over the edges e through m

share the residual out so that well-determined parameters move less: M is the diagonal
preconditioner, and w_e is the smallest eigenvalue of the rotation block of the edge's information
(for v_k: of the translation block). The gain in iteration t is ``g = min(1, rate_t L w_e / min_m
M_m)``: the step of preconditioned gradient descent, clipped so that no edge overshoots.

Learning rate. ``rate_t = 10 / (9 + t)``. Any harmonic decay converges to an equilibrium; the papers
leave its constant open. Plain 1/t cools down before a loop is closed: after 100 iterations the
error was up to 2.4 times that of Levenberg-Marquardt on graphs of rendered rooms, with the delay
1.07 times.

Order. Edges are visited by the depth of the top node of their path, so that what is moved first
carries the rest of the map with it. The descent stops when the summed error changes by less than
``epsilon`` of itself, but not while gains are clipped: full corrections in turn can go round in a
circle that only the decreasing gain leaves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.config.labels import PoseGraphConfig
from baselines.labels.posegraph.graph import PoseGraph, chi2
from baselines.labels.posegraph.sweep import sweep
from baselines.registry.kinds import LabelMethod
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of, relative

Array = NDArray[np.float64]

# Iterations over which the learning rate stays of the order of 1.
_DELAY = 10


@dataclass(frozen=True)
class _PathEdge:
    """An edge with what its updates need.

    Attributes:
        i_from_j: (4, 4) measured motion.
        nodes: (L,) the nodes whose parameters lie on the path, in order from i to j.
        upward: (L,) whether the path passes the node's parameter towards the parent.
        top_depth: Depth of the lowest common ancestor.
        weight: (2,) smallest eigenvalue of the information: rotation, translation.
    """

    i_from_j: Array
    nodes: NDArray[np.int64]
    upward: NDArray[np.bool_]
    top_depth: int
    weight: Array


def optimise_toro(graph: PoseGraph, iterations: int, epsilon: float) -> Array:
    """Optimise a pose graph by stochastic gradient descent on its tree.

    Args:
        graph: Initial poses and edges.
        iterations: Most passes over all edges.
        epsilon: Relative change of the summed error (chi²) at which the descent stops.

    Returns:
        Poses ``first_from_cam`` (n, 4, 4).

    Raises:
        ValueError: a node has no edge to a lower-numbered one, so no tree spans the graph.
    """
    parents = spanning_tree(graph)
    edges = sorted(_path_edges(graph, parents), key=lambda edge: edge.top_depth)
    stiffness = _stiffness(edges, len(graph))
    rates = np.array([len(e.nodes) * e.weight / stiffness.min(axis=0) for e in edges])
    first = np.cumsum([0, *(len(edge.nodes) for edge in edges)])
    nodes = np.concatenate([edge.nodes for edge in edges])
    upward = np.concatenate([edge.upward for edge in edges])
    shares = np.concatenate([_shares(stiffness[edge.nodes - 1]) for edge in edges])
    measured = np.array([edge.i_from_j for edge in edges])
    measured_quat, measured_m = quat_wxyz_of(measured), measured[:, :3, 3].copy()
    start = relative(graph.first_from_cam[parents], graph.first_from_cam)
    quat_wxyz, position_m = quat_wxyz_of(start), start[:, :3, 3].copy()
    error = chi2(graph, graph.first_from_cam)
    for iteration in range(1, iterations + 1):
        gains = np.minimum(1.0, rates * _DELAY / (_DELAY + iteration - 1))
        sweep(
            quat_wxyz=quat_wxyz,
            position_m=position_m,
            first=first,
            nodes=nodes,
            upward=upward,
            shares=shares,
            gains=gains,
            measured_quat=measured_quat,
            measured_m=measured_m,
        )
        poses = _poses(pose_from_quat(position_m, quat_wxyz), parents)
        previous, error = error, chi2(graph, poses)
        if gains.max() < 1 and abs(previous - error) <= epsilon * previous:
            break
    return poses


@LabelMethod(
    name="rgbd-toro",
    title="RGB-D SLAM w/ TORO",
    rank=2,
    works_on="graph",
    published_assisted=6,
)
def by_toro(graph: PoseGraph, cfg: PoseGraphConfig) -> NDArray[np.float64]:
    """Optimise a pose graph by TORO; see :func:`optimise_toro`."""
    return optimise_toro(graph, cfg.toro_iterations, cfg.toro_epsilon)


def spanning_tree(graph: PoseGraph) -> NDArray[np.int64]:
    """Find the parent (n,) of every node: its lowest-numbered neighbour; the root's is itself.

    Raises:
        ValueError: a node has no edge to a lower-numbered one.
    """
    parents = np.arange(len(graph))
    for edge in graph.edges:
        low, high = sorted((edge.i, edge.j))
        parents[high] = min(parents[high], low)
    orphans = np.flatnonzero(parents[1:] == np.arange(1, len(graph)))
    if len(orphans):
        raise ValueError(f"node {orphans[0] + 1} has no edge to a lower-numbered node")
    return parents


def _path_edges(graph: PoseGraph, parents: NDArray[np.int64]) -> list[_PathEdge]:
    """List all edges with their paths in the tree."""
    result = []
    for edge in graph.edges:
        up, down, node_i, node_j = [], [], edge.i, edge.j
        while node_i != node_j:  # a parent has a lower number: the higher of the two climbs
            if node_i > node_j:
                up.append(node_i)
                node_i = int(parents[node_i])
            else:
                down.append(node_j)
                node_j = int(parents[node_j])
        weight = [
            np.linalg.eigvalsh(edge.information[block, block])[0]
            for block in (slice(3, 6), slice(0, 3))
        ]
        nodes = np.array(up + down[::-1], dtype=np.int64)
        upward = np.arange(len(nodes)) < len(up)
        depth = _depth(node_i, parents)
        result.append(_PathEdge(edge.i_from_j, nodes, upward, depth, np.array(weight)))
    return result


def _depth(node: int, parents: NDArray[np.int64]) -> int:
    """Count the parents above a node."""
    depth = 0
    while node != 0:
        node, depth = int(parents[node]), depth + 1
    return depth


def _stiffness(edges: list[_PathEdge], n_nodes: int) -> Array:
    """Return M (n - 1, 2) of the nodes 1..n-1 for rotation and translation."""
    stiffness = np.zeros((n_nodes - 1, 2))
    for edge in edges:
        stiffness[edge.nodes - 1] += edge.weight
    return stiffness


def _shares(stiffness: Array) -> Array:
    """Return cumulative weights u and v (L, 2) along a path of nodes of ``stiffness`` (L, 2)."""
    compliance = 1.0 / stiffness
    return np.asarray(np.cumsum(compliance, axis=0) / compliance.sum(axis=0), dtype=np.float64)


def _poses(parent_from_node: Array, parents: NDArray[np.int64]) -> Array:
    """Return poses (n, 4, 4) relative to the first; rotations are made orthonormal again."""
    poses = np.empty_like(parent_from_node)
    poses[0] = np.eye(4)
    for node in range(1, len(poses)):
        poses[node] = poses[parents[node]] @ parent_from_node[node]
    return pose_from_quat(poses[:, :3, 3], quat_wxyz_of(poses))
