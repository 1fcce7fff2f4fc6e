"""Pose graphs: their files, their residuals, and the optimisers against SciPy and closed forms."""

from itertools import accumulate

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform, Rotation

from baselines.labels.posegraph.graph import (
    Edge,
    PoseGraph,
    check_connected,
    chi2,
    edge_residuals,
    read_g2o,
    swapped_blocks,
    write_g2o,
)
from baselines.labels.posegraph.levenberg_marquardt import optimise_lm
from baselines.labels.posegraph.open3d_optimiser import optimise_open3d
from baselines.labels.posegraph.toro import optimise_toro, spanning_tree
from synfeal.geometry.poses import pose_error, pose_matrix, relative
from tests.support.property_support import (
    direction,
    directions,
    few,
    pose_of,
    poses_near,
    random_poses,
    relative_to_first,
    seeds,
    turn,
    vectors,
)

INFORMATION = np.diag([1e4] * 3 + [1e5] * 3)
SIGMA_M, SIGMA_RAD = 1e-2, 1e5**-0.5
OPTIMISERS = {
    "lm": lambda graph: optimise_lm(graph, 100),
    "toro": lambda graph: optimise_toro(graph, 600, 1e-12),
    "open3d": lambda graph: optimise_open3d(graph, 100),
}


def small_motion(rng, size_m, size_rad):
    return pose_of(size_m * rng.normal(size=3), turn(direction(rng), size_rad * rng.normal()))


def random_graph(seed, count, noise=0.0):
    """A chain of poses with closures, measured with some noise, and its true poses."""
    rng = np.random.default_rng(seed)
    truth = relative_to_first(random_poses(seed, count))
    pairs = [(k, k + 1) for k in range(count - 1)]
    pairs += [tuple(rng.choice(count, 2, replace=False).tolist()) for _ in range(3)]
    edges = []
    for i, j in pairs:
        root = rng.normal(size=(6, 6))
        measured = np.linalg.inv(truth[i]) @ truth[j] @ small_motion(rng, noise, noise)
        edges.append(Edge(i, j, measured, root @ root.T + np.eye(6)))
    return PoseGraph(truth, tuple(edges))


def manhattan(rng, nodes=120, blocks=4, closure_m=1.1):
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


def walk_graph(noise):
    """True poses of a Manhattan walk from the first, and its graph with noise, in sigmas."""
    rng = np.random.default_rng(0)
    truth, pairs = manhattan(rng)
    edges = []
    for i, j in pairs:
        error = small_motion(rng, noise * SIGMA_M, noise * SIGMA_RAD)
        edges.append(Edge(i, j, relative(truth[i], truth[j]) @ error, INFORMATION))
    steps = [edge.i_from_j for edge in edges[: len(truth) - 1]]
    chained = accumulate(steps, np.matmul, initial=np.eye(4))
    return relative(truth[0], truth), PoseGraph(np.array(list(chained)), tuple(edges))


def scipy_solution(graph):
    """Minimum of the same sum of squares by another library, poses as exponentials of twists."""
    start = RigidTransform.from_matrix(graph.first_from_cam[1:])
    measured = [RigidTransform.from_matrix(edge.i_from_j).inv() for edge in graph.edges]
    # Twists are rotation first.
    roots = [np.linalg.cholesky(swapped_blocks(edge.information)).T for edge in graph.edges]

    def poses_at(twists):
        moved = start * RigidTransform.from_exp_coords(twists.reshape(-1, 6))
        return [RigidTransform.identity(), *moved]

    def residuals(twists):
        poses = poses_at(twists)
        off = [
            j_from_i * poses[e.i].inv() * poses[e.j]
            for e, j_from_i in zip(graph.edges, measured, strict=True)
        ]
        return np.concatenate(
            [root @ o.as_exp_coords() for root, o in zip(roots, off, strict=True)]
        )

    found = least_squares(residuals, np.zeros(6 * len(start)), xtol=1e-12, ftol=1e-12)
    return np.array([pose.as_matrix() for pose in poses_at(found.x)])


def test_lm_finds_the_minimum_that_scipy_finds():
    graph = random_graph(2, 10, 0.01)
    expected = scipy_solution(graph)
    assert pose_error(expected, graph.first_from_cam)[0].max() > 1e-3
    np.testing.assert_allclose(optimise_lm(graph, 50), expected, atol=1e-6)


@few
@given(seeds, st.integers(2, 5))
def test_g2o_files_are_read_back_as_they_were_written_and_the_same_by_gtsam(
    tmp_path_factory, seed, count
):
    """Where gtsam has information with rotation first."""
    import gtsam

    graph, path = random_graph(seed, count, 0.1), tmp_path_factory.mktemp("graph") / "a.g2o"
    write_g2o(path, graph)
    found = read_g2o(path)
    factors, values = gtsam.readG2o(str(path), True)
    np.testing.assert_allclose(found.first_from_cam, graph.first_from_cam, atol=1e-14)
    for node, pose in enumerate(graph.first_from_cam):
        np.testing.assert_allclose(values.atPose3(node).matrix(), pose, atol=1e-12)
    for k, (edge, same) in enumerate(zip(graph.edges, found.edges, strict=True)):
        factor = factors.at(k)
        assert (edge.i, edge.j) == (same.i, same.j) == tuple(factor.keys())
        np.testing.assert_allclose(same.i_from_j, edge.i_from_j, atol=1e-14)
        np.testing.assert_allclose(factor.measured().matrix(), edge.i_from_j, atol=1e-12)
        symmetric = np.triu(edge.information) + np.triu(edge.information, 1).T
        np.testing.assert_array_equal(same.information, symmetric)
        theirs = factor.noiseModel().information()
        np.testing.assert_allclose(theirs, swapped_blocks(edge.information), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", OPTIMISERS)
def test_confident_edges_move_less(name):
    """Two edges disagree on one motion: the answer is their mean, weighted by information."""
    near, far = pose_matrix(np.eye(3), [1.0, 0, 0]), pose_matrix(np.eye(3), [2.0, 0, 0])
    edges = (Edge(0, 1, near, 3 * INFORMATION), Edge(0, 1, far, INFORMATION))
    graph = PoseGraph(np.array([np.eye(4), far]), edges)
    found = OPTIMISERS[name](graph)
    np.testing.assert_allclose(found[1, :3, 3], [1.25, 0, 0], atol=0.02)


@pytest.mark.parametrize("name", OPTIMISERS)
def test_a_noise_free_graph_is_recovered_from_a_bad_start(name):
    truth, graph = walk_graph(0.0)
    rng = np.random.default_rng(1)
    start = truth @ np.array([small_motion(rng, 0.1, 0.05) for _ in truth])
    start[0] = np.eye(4)
    position_m, orientation_rad = pose_error(OPTIMISERS[name](PoseGraph(start, graph.edges)), truth)
    assert position_m.max() < 1e-6
    assert orientation_rad.max() < 1e-6


def test_toro_comes_near_least_squares():
    _, graph = walk_graph(2.0)
    best = chi2(graph, optimise_lm(graph, 100))
    assert 0.999 * best <= chi2(graph, optimise_toro(graph, 100, 1e-5)) <= 1.3 * best


@pytest.mark.parametrize("name", ["lm", "toro"])  # Open3D's steps are too long: it stays 7 m away
def test_nodes_that_are_upside_down_find_their_way(name):
    """A walk whose last third starts turned by 170 degrees about its own axis."""
    truth, graph = walk_graph(0.0)
    turned = pose_matrix(Rotation.from_euler("z", 170, True).as_matrix(), [0, 0, 0])
    start = np.concatenate([truth[:80], truth[80:] @ turned])
    position_m, _ = pose_error(OPTIMISERS[name](PoseGraph(start, graph.edges)), truth)
    assert position_m.max() < 1e-4


@few
@given(seeds, st.integers(2, 6), poses_near)
def test_residuals_vanish_at_the_truth_and_see_no_common_motion(seed, count, world):
    graph = random_graph(seed, count)
    np.testing.assert_allclose(edge_residuals(graph, graph.first_from_cam), 0.0, atol=1e-7)
    assert chi2(graph, graph.first_from_cam) == pytest.approx(0.0, abs=1e-11)
    other = np.array(random_poses(seed + 1, count))
    residuals = edge_residuals(graph, other)
    np.testing.assert_allclose(edge_residuals(graph, world @ other), residuals, atol=1e-7)
    by_hand = sum(r @ edge.information @ r for r, edge in zip(residuals, graph.edges, strict=True))
    assert chi2(graph, other) == pytest.approx(by_hand)


@few
@given(poses_near, directions, st.floats(0.0, 3.0), vectors(2.0))
def test_residual_of_an_edge_is_the_motion_it_is_off_by(measured, axis, angle, way):
    off = pose_of(way, turn(axis, angle))
    start = pose_of([1.0, 2.0, 3.0], turn([0, 1.0, 0], 0.4))
    graph = PoseGraph(np.array([start, start]), (Edge(0, 1, measured, np.eye(6)),))
    found = edge_residuals(graph, np.array([start, start @ measured @ off]))[0]
    np.testing.assert_allclose(found, [*way, *(angle * axis)], atol=1e-7)


@few
@given(st.integers(2, 8), st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=12))
def test_a_graph_is_connected_if_edges_lead_everywhere(count, pairs):
    pairs = [(i, j) for i, j in pairs if i != j and max(i, j) < count]
    edges = tuple(Edge(i, j, np.eye(4), np.eye(6)) for i, j in pairs)
    graph = PoseGraph(np.tile(np.eye(4), (count, 1, 1)), edges)
    reached = {0}
    for _ in range(count):
        reached |= {b for pair in pairs for a, b in (pair, pair[::-1]) if a in reached}
    if len(reached) == count:
        check_connected(graph)
    else:
        first = min(set(range(count)) - reached)
        with pytest.raises(ValueError, match=f"^node {first} is not connected to node 0"):
            check_connected(graph)
    lowest = [min([n] + [min(p) for p in pairs if max(p) == n]) for n in range(count)]
    orphans = [n for n in range(1, count) if lowest[n] == n]
    if orphans:
        with pytest.raises(ValueError, match=f"^node {orphans[0]} has no edge to a lower"):
            spanning_tree(graph)
    else:
        assert spanning_tree(graph).tolist() == lowest
