"""Properties of pose graphs and their optimisers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from baselines.groundtruth.posegraph.graph import (
    Edge,
    PoseGraph,
    check_connected,
    chi2,
    edge_residuals,
    read_g2o,
    swapped_blocks,
    write_g2o,
)
from baselines.groundtruth.posegraph.optimise import optimise, optimise_lm
from baselines.groundtruth.posegraph.toro import optimise_toro, spanning_tree
from synfeal.config.models import PoseGraphConfig
from tests.property_support import directions, few, fewer, pose_of, poses_near, seeds, turn, vectors
from tests.walks import direction, random_poses, relative_to_first


def random_graph(seed, count, noise=0.0):
    """A chain of poses with closures, measured with some noise, and its true poses."""
    rng = np.random.default_rng(seed)
    truth = relative_to_first(random_poses(seed, count))
    pairs = [(k, k + 1) for k in range(count - 1)]
    pairs += [tuple(rng.choice(count, 2, replace=False).tolist()) for _ in range(3)]
    edges = []
    for i, j in pairs:
        error = pose_of(noise * rng.normal(size=3), turn(direction(rng), noise))
        root = rng.normal(size=(6, 6))
        measured = np.linalg.inv(truth[i]) @ truth[j] @ error
        edges.append(Edge(i, j, measured, root @ root.T + np.eye(6)))
    return PoseGraph(truth, tuple(edges))


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
@given(vectors(5.0, 36), vectors(5.0, 6))
def test_swapping_blocks_exchanges_translation_and_rotation(cells, residual):
    matrix = cells.reshape(6, 6)
    swapped = swapped_blocks(matrix)
    other = np.concatenate([residual[3:], residual[:3]])
    np.testing.assert_allclose(other @ swapped @ other, residual @ matrix @ residual, atol=1e-10)
    np.testing.assert_array_equal(swapped_blocks(swapped), matrix)


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


@few
@given(seeds, st.integers(2, 5))
def test_graphs_are_read_back_as_they_were_written(tmp_path_factory, seed, count):
    graph, path = random_graph(seed, count, 0.1), tmp_path_factory.mktemp("graph") / "a.g2o"
    write_g2o(path, graph)
    found = read_g2o(path)
    np.testing.assert_allclose(found.first_from_cam, graph.first_from_cam, atol=1e-14)
    for edge, same in zip(graph.edges, found.edges, strict=True):
        assert (edge.i, edge.j) == (same.i, same.j)
        np.testing.assert_allclose(same.i_from_j, edge.i_from_j, atol=1e-14)
        symmetric = np.triu(edge.information) + np.triu(edge.information, 1).T
        np.testing.assert_array_equal(same.information, symmetric)


@fewer
@given(seeds, st.integers(3, 7))
# Started where only the noise of the edges is left, TORO, which knows no covariances, ends above.
@example(9846007, 4)
def test_optimisers_keep_the_first_pose_and_end_below_a_start_that_is_off(seed, count):
    graph = random_graph(seed, count, 0.05)
    rng = np.random.default_rng(seed + 1)
    off = [pose_of(0.5 * direction(rng), turn(direction(rng), 0.5)) for _ in range(count - 1)]
    start = graph.first_from_cam @ np.array([np.eye(4), *off])
    cfg = PoseGraphConfig()
    far = replace(graph, first_from_cam=start)
    for found in (
        optimise_lm(far, cfg.lm_iterations),
        optimise("toro", far, cfg).first_from_cam,
        optimise_toro(far, cfg.toro_iterations, cfg.toro_epsilon),
    ):
        np.testing.assert_allclose(found[0], np.eye(4), atol=1e-7)
        np.testing.assert_allclose(np.linalg.det(found[:, :3, :3]), 1.0, atol=1e-9)
        assert chi2(graph, found) < chi2(graph, start)
    assert chi2(graph, optimise_lm(graph, cfg.lm_iterations)) <= chi2(graph, graph.first_from_cam)
