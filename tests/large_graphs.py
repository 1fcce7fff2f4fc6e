"""Large pose graphs in the style of the public ones: a sphere and a Manhattan world."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from baselines.groundtruth.posegraph.graph import Edge, PoseGraph
from synfeal.geometry.poses import pose_matrix, relative

Array = NDArray[np.float64]


def sphere(rings=44, ring_nodes=50, radius_m=50.0):
    """Poses (rings * ring_nodes, 4, 4) of a spiral over a sphere, and its edges.

    A node is joined to the next one on its ring and to the two nearest of the ring before.
    """
    step = np.arange(rings * ring_nodes)
    azimuth = 2 * np.pi * step / ring_nodes
    polar = np.pi * (0.05 + 0.9 * step / len(step))
    normal = np.column_stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    )
    east = np.column_stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)])
    rotation = np.stack([east, np.cross(normal, east), normal], axis=2)
    pairs = [(k, k + 1) for k in range(len(step) - 1)]
    for back in (ring_nodes, ring_nodes - 1):
        pairs += [(k - back, k) for k in range(back, len(step))]
    return pose_matrix(rotation, radius_m * normal), pairs


def manhattan(rng, nodes=3500, blocks=18, closure_m=1.1):
    """Poses (nodes, 4, 4) of a walk on a street grid with right-angled turns, and its edges.

    A node is joined to the next one and to at most two earlier ones at the same corner or the next.
    """
    position, heading = np.zeros((nodes, 3)), np.zeros(nodes, dtype=int)
    direction = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
    for k in range(1, nodes):
        turn = rng.choice([0, 0, 1, 3]) if k % 3 == 0 else 0
        heading[k] = (heading[k - 1] + turn) % 4
        while np.abs(position[k - 1] + direction[heading[k]]).max() > blocks:
            heading[k] = (heading[k] + 1) % 4
        position[k] = position[k - 1] + direction[heading[k]]
    rotation = Rotation.from_euler("z", heading[:, None] * np.pi / 2).as_matrix()
    pairs = [(k, k + 1) for k in range(nodes - 1)]
    near = cKDTree(position).query_ball_point(position, closure_m)
    for k, around in enumerate(near):
        pairs += [(i, k) for i in sorted(i for i in around if i < k - 10)[:2]]
    return pose_matrix(rotation, position), pairs


def measured(rng, truth, pairs, sigma_m, sigma_rad):
    """The graph of noisy measurements; its initial poses chain the edges (k, k + 1)."""
    i, j = np.array(pairs).T
    turn = Rotation.from_rotvec(sigma_rad * rng.normal(size=(len(pairs), 3))).as_matrix()
    error = pose_matrix(turn, sigma_m * rng.normal(size=(len(pairs), 3)))
    motion = relative(truth[i], truth[j]) @ error
    information = np.diag([max(sigma_m, 1e-3) ** -2.0] * 3 + [max(sigma_rad, 1e-3) ** -2.0] * 3)
    edges = [Edge(a, b, m, information) for (a, b), m in zip(pairs, motion, strict=True)]
    initial = [np.eye(4)]
    for k in range(len(truth) - 1):
        initial.append(initial[-1] @ motion[k])
    return PoseGraph(np.array(initial), tuple(edges))
