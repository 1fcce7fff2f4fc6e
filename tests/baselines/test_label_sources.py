"""Properties of every source of labels alike."""

import numpy as np
import pytest

from baselines.config.labels import EstimationConfig
from baselines.labels import methods
from baselines.labels.batches import batches_of, read_trajectory, write_trajectory
from baselines.labels.chain import chain_batches, summary_of
from baselines.labels.injected import add_noise
from baselines.labels.label_error import absolute_errors
from baselines.labels.rgbd import rgbd_graph
from baselines.labels.sfm import sfm_batch
from tests.support.room_scene import CAMERA, straight_path, write_planes

CFG = EstimationConfig(batch_frames=6, sfm={"max_features": 400}, rgbd={"keyframe_every": 3})
TRUTH = straight_path(10, step_m=0.06, turn_deg=1.5)
BATCHES = batches_of(len(TRUTH), CFG.batch_frames)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    return write_planes(tmp_path_factory.mktemp("planes"), TRUTH)


@pytest.fixture(scope="module")
def graphs(paths):
    return [
        rgbd_graph(paths[0][b.start : b.stop], paths[1][b.start : b.stop], CAMERA, CFG.rgbd)[0]
        for b in BATCHES
    ]


def estimated(source, batch, paths):
    """A batch by a method that works on images."""
    color, depth = (files[batch.start : batch.stop] for files in paths)
    if source in methods.frame_methods():
        return methods.estimate_batch(source, color, depth, CAMERA, CFG, 0)[0]
    truth = TRUTH.world_from_cam[batch.start : batch.stop]
    return sfm_batch(color, CAMERA, truth, CFG.sfm, 0)[0]


@pytest.fixture(scope="module", params=["synfeal", "noise", *methods.METHODS])
def labels(request, paths, graphs, tmp_path_factory):
    """Labels of one source; the estimated ones pass through their files as in a run."""
    folder, source = tmp_path_factory.mktemp("batches"), request.param
    if source == "synfeal":
        return TRUTH
    if source == "noise":
        return add_noise(TRUTH, 0.1, 5.0, np.random.default_rng(0))
    if source in methods.graph_methods():
        estimates = [methods.solve_graph(source, graph, CFG.posegraph)[0] for graph in graphs]
    else:
        estimates = [estimated(source, batch, paths) for batch in BATCHES]
    for batch, estimate in zip(BATCHES, estimates, strict=True):
        write_trajectory(folder / f"batch-{batch.index:03d}.csv", estimate)
    read = [read_trajectory(path) for path in sorted(folder.glob("*.csv"))]
    table, assistance = chain_batches(BATCHES, read, TRUTH, CFG)
    # Planes leave a motion free that KinectFusion, without colour, cannot find.
    assert summary_of(assistance)["lost"] == (len(BATCHES) if source == "kinect-fusion" else 0)
    assert summary_of(assistance)["assisted"] == summary_of(assistance)["lost"]
    return table


def test_every_frame_has_one_finite_label_near_the_truth(labels):
    np.testing.assert_array_equal(labels.frame, TRUTH.frame)
    np.testing.assert_array_equal(labels.path, TRUTH.path)
    assert labels.position_m.shape == TRUTH.position_m.shape
    assert np.isfinite(labels.position_m).all()
    np.testing.assert_allclose(np.linalg.norm(labels.quat_wxyz, axis=1), 1, atol=1e-12)
    assert (labels.quat_wxyz[:, 0] >= 0).all()
    position_m, orientation_deg = absolute_errors(labels, TRUTH)
    assert position_m.max() < 0.11
    assert orientation_deg.max() < 5.1
