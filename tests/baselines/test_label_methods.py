"""Label methods: the example of the page on adding one, and odometry alone."""

import sys
import types
from pathlib import Path

import numpy as np
import pytest

from baselines.config.labels import EstimationConfig, PoseGraphConfig
from baselines.labels import methods
from baselines.labels.batches import batches_of
from baselines.labels.chain import chain_batches
from baselines.labels.methods import METHODS, estimate_batch, solve_graph
from baselines.labels.posegraph.graph import Edge, PoseGraph
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import pose_matrix
from tests.support.added_methods import examples
from tests.support.room_scene import straight_path

CAMERA, CFG = CameraConfig(), EstimationConfig(batch_frames=10)


@pytest.fixture
def constant(monkeypatch):
    """The method of the page, added as the page says."""
    module = types.ModuleType("my_methods.constant")
    exec(examples()["constant"], module.__dict__)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    kind = module.constant_batch.kind
    monkeypatch.setitem(METHODS, kind.name, kind)
    return kind.name


def test_the_example_of_the_page_labels_a_split(constant):
    truth = straight_path(21, step_m=0.03, turn_deg=0.0)
    batches = batches_of(len(truth), CFG.batch_frames)
    estimates = []
    for batch in batches:
        paths = [Path(f"{k}.png") for k in range(batch.start, batch.stop)]
        trajectory, facts = estimate_batch(constant, paths, paths, CAMERA, CFG, seed=0)
        assert set(facts) == {"estimation_s", "peak_memory_mb"}
        assert facts["peak_memory_mb"] > 1
        estimates.append(trajectory)
    labels, record = chain_batches(batches, estimates, truth, CFG)
    # The camera moves 30 cm in a batch: each is assisted, and all other labels stand still.
    assert [(b.assisted, b.lost) for b in record] == [(True, False)] * 2
    np.testing.assert_allclose(labels.position_m[:10], np.tile(truth.position_m[0], (10, 1)))
    np.testing.assert_allclose(labels.position_m[10:20], np.tile(truth.position_m[10], (10, 1)))
    np.testing.assert_allclose(labels.position_m[20], truth.position_m[20])
    assert constant in methods.frame_methods()
    assert methods.stages_of(constant) == (constant,)


def test_odometry_alone_keeps_the_chain_that_an_optimiser_moves():
    """Two motions of 1 m, and a closure that says 2.3 m: least squares gives each a third of it."""
    unit = pose_matrix(np.eye(3), [1.0, 0, 0])
    chain = np.stack([np.eye(4), unit, unit @ unit])
    closure = pose_matrix(np.eye(3), [2.3, 0, 0])
    edges = [
        Edge(i, j, pose, np.eye(6)) for i, j, pose in ((0, 1, unit), (1, 2, unit), (0, 2, closure))
    ]
    graph, cfg = PoseGraph(chain, tuple(edges)), PoseGraphConfig()
    alone, facts = solve_graph("rgbd-odometry", graph, cfg)
    np.testing.assert_array_equal(alone.first_from_cam, chain)
    assert alone.registered.all()
    assert facts["estimation_s"] >= 0
    for name in ("rgbd-g2o", "rgbd-open3d"):
        solved, _ = solve_graph(name, graph, cfg)
        np.testing.assert_allclose(solved.first_from_cam[:, 0, 3], [0, 1.1, 2.2], atol=1e-4)
