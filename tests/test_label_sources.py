"""What holds for every source of labels alike."""

import numpy as np
import pytest

from baselines.groundtruth.batches import batches_of
from baselines.groundtruth.chain import chain_batches, label_error
from baselines.groundtruth.posegraph.lm import optimise_lm
from baselines.groundtruth.posegraph.toro import optimise_toro
from baselines.groundtruth.rgbd import rgbd_graph
from baselines.groundtruth.sfm import sfm_batch
from baselines.groundtruth.trajectory import BatchTrajectory, read_trajectory, write_trajectory
from synfeal.config.models import GroundTruthConfig
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.labels.noise import add_noise
from tests.planar_scene import CAMERA, straight_path, write_frames

CFG = GroundTruthConfig(batch_frames=6, sfm={"max_features": 400}, rgbd={"keyframe_every": 3})
TRUTH = straight_path(10, step_m=0.06, turn_deg=1.5)
BATCHES = batches_of(len(TRUTH), CFG.batch_frames)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    return write_frames(tmp_path_factory.mktemp("planes"), TRUTH)


@pytest.fixture(scope="module")
def graphs(paths):
    return [
        rgbd_graph(paths[0][b.start : b.stop], paths[1][b.start : b.stop], CAMERA, CFG.rgbd)
        for b in BATCHES
    ]


@pytest.fixture(scope="module", params=["synfeal", "noise", "sfm", "rgbd-toro", "rgbd-g2o"])
def labels(request, paths, graphs, tmp_path_factory):
    """Labels of one source; the estimated ones pass through their files as in a run."""
    folder = tmp_path_factory.mktemp("batches")
    if request.param == "synfeal":
        return TRUTH
    if request.param == "noise":
        return add_noise(TRUTH, 0.1, 5.0, np.random.default_rng(0))
    if request.param == "sfm":
        poses = TRUTH.world_from_cam
        estimates = [
            sfm_batch(
                paths[0][b.start : b.stop], CAMERA, poses[b.start : b.stop], CFG.sfm, 0, folder
            )
            for b in BATCHES
        ]
    else:
        optimise = {
            "rgbd-toro": lambda graph: optimise_toro(graph, 100, 1e-5),
            "rgbd-g2o": lambda graph: optimise_lm(graph, 20),
        }[request.param]
        estimates = [
            BatchTrajectory(optimise(graph), np.ones(len(graph), dtype=bool)) for graph in graphs
        ]
    for batch, estimate in zip(BATCHES, estimates, strict=True):
        write_trajectory(folder / f"batch-{batch.index:03d}.csv", estimate)
    read = [read_trajectory(path) for path in sorted(folder.glob("*.csv"))]
    table, assistance = chain_batches(BATCHES, read, TRUTH, CFG)
    assert assistance.to_json()["assisted"] == 0
    return table


def test_one_label_per_frame_in_order(labels):
    np.testing.assert_array_equal(labels.frame, TRUTH.frame)
    np.testing.assert_array_equal(labels.path, TRUTH.path)
    assert labels.position_m.shape == TRUTH.position_m.shape


def test_labels_are_finite_and_canonical(labels):
    assert np.isfinite(labels.position_m).all()
    np.testing.assert_allclose(np.linalg.norm(labels.quat_wxyz, axis=1), 1, atol=1e-12)
    assert (labels.quat_wxyz[:, 0] >= 0).all()


def test_labels_are_near_the_truth(labels):
    error = label_error(labels, TRUTH)
    assert error.max_m < 0.11
    assert error.max_deg < 5.1


def test_labels_survive_their_file_bit_for_bit(labels, tmp_path):
    path = tmp_path / "train.csv"
    write_pose_table(path, labels)
    again = read_pose_table(path)
    for name in ("frame", "path", "position_m", "quat_wxyz"):
        np.testing.assert_array_equal(getattr(again, name), getattr(labels, name))
