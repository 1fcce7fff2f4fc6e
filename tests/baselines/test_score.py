"""Scores with known answers, which keep their digits from the predictions to the table."""

import json
import math
import subprocess
import sys

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.training.predict import predict_poses
from baselines.training.score import score_common, score_run
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.errors import InputError
from synfeal.records.tables import read_records
from tests.support.colored_frames import NETWORK, answering, save
from tests.support.property_support import random_table

N = 40


def moved(table, offset_m, angle_rad):
    """Every pose shifted by ``offset_m`` and turned by ``angle_rad`` about its own axis."""
    axes = np.random.default_rng(5).normal(size=(len(table), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turned = Rotation.from_quat(table.quat_wxyz, scalar_first=True) * Rotation.from_rotvec(
        angle_rad * axes
    )
    quat = turned.as_quat(canonical=True, scalar_first=True)
    return PoseTable(table.frame, table.path, table.position_m + offset_m, quat)


@pytest.fixture
def score(tmp_path):
    """Score predictions (a table, or a file by its name); returns metrics and rows of errors."""

    def run(predicted, labels, truth=None, train=None):
        tables = {"labels": labels, "truth": truth or labels, "train": train or labels}
        if isinstance(predicted, PoseTable):
            tables["predictions"] = predicted
        for name, table in tables.items():
            write_pose_table(tmp_path / f"{name}.csv", table)
        names = ("predictions", "labels", "truth", "train")
        outputs = tmp_path / "errors.csv", tmp_path / "metrics.json"
        score_run(*(tmp_path / f"{name}.csv" for name in names), *outputs, {"model": "posenet"})
        rows = [row for _, row in read_records(outputs[0])]
        return json.loads(outputs[1].read_text()), rows

    return run


def test_known_motions_give_known_errors_against_labels_and_truth(score):
    truth = random_table(N, 1)
    labels = moved(truth, np.array([3.0, 0.0, 4.0]), 0.0)
    predicted = moved(truth, np.array([0.0, 0.0, 0.0]), math.radians(25))
    metrics, errors = score(predicted, labels, truth, truth)
    assert metrics["position_m"] == pytest.approx(5.0)
    assert metrics["position_rms_m"] == pytest.approx(5.0 / math.sqrt(3))
    assert metrics["position_m_true"] == pytest.approx(0.0, abs=1e-12)
    assert metrics["orientation_deg"] == pytest.approx(25.0)
    assert metrics["orientation_deg_true"] == pytest.approx(25.0)
    assert all(float(row["orientation_deg"]) == pytest.approx(25.0) for row in errors)
    assert [int(row["frame"]) for row in errors] == list(range(N))


def test_on_the_common_test_set_each_frame_is_compared_with_its_own_true_pose(tmp_path):
    truth = random_table(N, 1)
    part = moved(truth, np.array([3.0, 0.0, 4.0]), math.radians(25)).at(np.arange(0, N, 8))
    files = [tmp_path / name for name in ("predictions.csv", "truth.csv", "errors.csv")]
    write_pose_table(files[0], part)
    write_pose_table(files[1], truth)
    score_common(*files)
    rows = [row for _, row in read_records(files[2])]
    assert [int(row["frame"]) for row in rows] == [0, 8, 16, 24, 32]
    assert [float(row["position_m"]) for row in rows] == pytest.approx([5.0] * 5)
    assert [float(row["orientation_deg"]) for row in rows] == pytest.approx([25.0] * 5)
    write_pose_table(files[1], truth.first(30))
    with pytest.raises(InputError, match=r"predictions\.csv: has frames that"):
        score_common(*files)
    others = [files[0], *[files[1]] * 3, files[2], tmp_path / "metrics.json"]
    with pytest.raises(InputError, match=r"truth\.csv: its frames are not those"):
        score_run(*others, {})


def test_the_mean_pose_and_the_true_poses_are_scored_against_the_labels_too(score):
    """Cameras turned by -20, 0 and 20 degrees about one axis have no rotation for their mean."""
    turns = np.radians([-20.0, 0.0, 20.0] * 5)
    axes = np.array([0.0, 0.0, 1.0])
    quat = Rotation.from_rotvec(turns[:, None] * axes).as_quat(canonical=True, scalar_first=True)
    frame = np.arange(15)
    train = PoseTable(frame, frame, np.tile([1.0, 2.0, 3.0], (15, 1)), quat)
    truth = PoseTable(frame, frame, train.position_m, np.tile([1.0, 0, 0, 0], (15, 1)))
    labels = moved(truth, np.array([0.0, 3.0, 4.0]), math.radians(30))
    metrics, _ = score(truth, labels, truth, train)
    assert metrics["baseline_position_m_true"] == pytest.approx(0, abs=1e-12)
    assert metrics["baseline_orientation_deg_true"] == pytest.approx(0, abs=1e-9)
    assert metrics["baseline_position_m"] == metrics["floor_position_m"] == pytest.approx(5)
    assert metrics["baseline_orientation_deg"] == pytest.approx(30)
    assert metrics["floor_orientation_deg"] == pytest.approx(30)


def test_scoring_needs_no_torch():
    modules = "baselines.training.score, baselines.localizers.registry"
    code = f"import sys, {modules}; print(sorted(sys.modules))"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert "'torch'" not in result.stdout


MP = mpmath.MPContext()
MP.dps = 60
GAPS = [0.0, *(10.0**-k for k in range(12, 2, -1))]
ANGLES = [*GAPS, 1.0, *(MP.pi - MP.mpf(gap) for gap in GAPS)]


def turned(base, axis, angle):
    """The unit quaternion ``base`` followed by a turn, rounded to doubles at the end."""
    half = MP.mpf(angle) / 2
    length = MP.sqrt(sum(MP.mpf(v) ** 2 for v in axis))
    w, *v = MP.cos(half), *(MP.sin(half) * MP.mpf(a) / length for a in axis)
    b = [MP.mpf(value) for value in base]
    product = (
        b[0] * w - b[1] * v[0] - b[2] * v[1] - b[3] * v[2],
        b[0] * v[0] + b[1] * w + b[2] * v[2] - b[3] * v[1],
        b[0] * v[1] - b[1] * v[2] + b[2] * w + b[3] * v[0],
        b[0] * v[2] + b[1] * v[1] - b[2] * v[0] + b[3] * w,
    )
    return np.array([float(value) for value in product])


BASES = ((1.0, 0.0, 0.0, 0.0), (0.5, -0.5, 0.5, 0.5), (0.1, 0.7, -0.5, 0.5))
AXES = ((0.0, 0.0, 1.0), (2.0, -3.0, 6.0))


def table(quat_wxyz, position_m=None):
    frame = np.arange(len(quat_wxyz))
    if position_m is None:
        position_m = np.zeros((len(frame), 3))
    return PoseTable(frame, frame // 4, position_m, quat_wxyz)


@pytest.mark.parametrize("base", BASES)
def test_the_errors_written_are_exact_to_a_billionth_of_a_radian(score, base):
    """The whole path: numbers to text, text to numbers, angles, degrees, text."""
    quats = np.array([turned(base, AXES[1], angle) for angle in ANGLES])
    offset_m = np.outer(0.1 * np.arange(len(quats)), [3.0, 0.0, 4.0])
    _, rows = score(table(quats, offset_m), table(np.tile(base, (len(quats), 1))))
    for row, angle, index in zip(rows, ANGLES, range(len(rows)), strict=True):
        found_rad = MP.mpf(row["orientation_deg"]) * MP.pi / 180
        assert abs(found_rad - angle) < 2e-15
        assert MP.mpf(row["orientation_deg"]) == MP.mpf(row["orientation_deg_true"])
        assert float(row["position_m"]) == pytest.approx(0.5 * index, rel=1e-15, abs=0)


NO_POSE = {
    "quaternion 0": ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]),
    "nan in the quaternion": ([0.0, 0.0, 0.0], [1.0, math.nan, 0.0, 0.0]),
    "nan in the position": ([0.0, math.nan, 0.0], [1.0, 0.0, 0.0, 0.0]),
    "inf in the position": ([0.0, 0.0, -math.inf], [1.0, 0.0, 0.0, 0.0]),
    "inf in the quaternion": ([0.0, 0.0, 0.0], [math.inf, 0.0, 0.0, 0.0]),
    "no unit quaternion": ([0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]),
    "a quaternion of length 1e-200": ([0.0, 0.0, 0.0], [1e-200, 0.0, 0.0, 0.0]),
    "a quaternion of length 1e200": ([0.0, 0.0, 0.0], [1e200, 0.0, 0.0, 0.0]),
    "a position of 1e200 m": ([1e200, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
}


@pytest.mark.parametrize("kind", NO_POSE)
@pytest.mark.parametrize("lost", [1, N // 2, N])
def test_what_is_no_pose_has_failed(score, kind, lost):
    truth = table(np.tile([1.0, 0.0, 0.0, 0.0], (N, 1)))
    position, quat = truth.position_m.copy(), truth.quat_wxyz.copy()
    position[:lost], quat[:lost] = NO_POSE[kind]
    metrics, rows = score(table(quat, position), truth)
    assert metrics["failed"] == lost
    for name in ("position_m", "orientation_deg", "position_m_true", "orientation_deg_true"):
        assert [float(row[name]) for row in rows] == [math.inf] * lost + [0.0] * (N - lost)
        # Even of half: the median of an even number is the mean of the middle two.
        assert metrics[name] == (None if lost >= N // 2 else 0.0)


@pytest.mark.parametrize("quat_wxyz", [[0.0] * 4, [math.nan] * 4, [math.inf, 0.0, 0.0, 0.0]])
def test_a_network_without_an_answer_is_scored_as_failed(score, tmp_path, quat_wxyz):
    """From the network's output to the score, through the files between them."""
    model = save(tmp_path / "model.pt", answering([1.0, 2.0, 3.0], quat_wxyz))
    np.save(tmp_path / "frames.npy", np.zeros((N, NETWORK.input_px, NETWORK.input_px, 3), np.uint8))
    truth = table(np.tile([1.0, 0.0, 0.0, 0.0], (N, 1)))
    write_pose_table(tmp_path / "labels.csv", truth)
    out = tmp_path / "predictions.csv"
    predict_poses(model, tmp_path / "frames.npy", tmp_path / "labels.csv", out, "cpu")
    metrics, _ = score(out, truth)
    assert (metrics["failed"], metrics["position_m"], metrics["orientation_deg"]) == (N, None, None)
