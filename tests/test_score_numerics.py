"""Scores keep their digits from the predictions to the table, and what is no pose has none."""

import json
import math

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from baselines.training.predict import predict_poses
from baselines.training.score import score_run
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.evaluation.metrics import cumulative
from synfeal.frames import read_records
from synfeal.report.cells import read_cells
from synfeal.report.compare.runs import read_run
from tests.report_results import design_of, experiment
from tests.trained_localizers import NETWORK, answering, save

MP = mpmath.MPContext()
MP.dps = 60
N = 24
GAPS = [0.0, *(10.0**-k for k in range(12, 2, -1))]
ANGLES = [*GAPS, 1.0, *(MP.pi - MP.mpf(gap) for gap in GAPS)]
Array = NDArray[np.float64]


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


@pytest.fixture
def score(tmp_path):
    """Score predictions against labels that are also the truth; metrics and rows of errors."""

    def run(predicted, labels, out=tmp_path):
        write_pose_table(out / "labels.csv", labels)
        if isinstance(predicted, PoseTable):
            write_pose_table(out / "predictions.csv", predicted)
        label_files = [out / "labels.csv"] * 3
        files = [out / "errors.csv", out / "metrics.json"]
        score_run(out / "predictions.csv", *label_files, *files, {})
        return json.loads(files[1].read_text()), [row for _, row in read_records(files[0])]

    return run


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


def test_a_diverged_repetition_is_counted_and_averaged_into_nothing(score, tmp_path):
    """Three seeds of one cell, the second lost: the mean is that of the other two."""
    row = experiment("table4_size")
    truth = table(np.tile([1.0, 0.0, 0.0, 0.0], (N, 1)))
    seeds = []
    for repetition, offset_m in enumerate((0.5, math.nan, 1.5)):
        out = tmp_path / f"runs/large_room/6k/synfeal/{row.init}/posenet/seed{repetition}"
        out.mkdir(parents=True)
        seeds.append(out)
        score(table(truth.quat_wxyz, truth.position_m + np.array([offset_m, 0.0, 0.0])), truth, out)
        for model in ("poselstm", "hourglass", "posenet2resnet", "posenet2"):
            other = out.parent.parent / model / out.name
            other.mkdir(parents=True)
            (other / "metrics.json").write_bytes((out / "metrics.json").read_bytes())
    for cell in read_cells("table4_size", design_of([row], 3), tmp_path).itertuples():
        assert (cell.position_m, cell.position_m_sd) == (1.0, math.sqrt(0.5))
        # All paths agree, so the limits are those of the two seeds: 1.96 * sqrt(0.5) / sqrt(2).
        assert cell.position_m_low == pytest.approx(0.02)
        assert cell.position_m_high == pytest.approx(1.98)
        assert (cell.failed, cell.n_seeds, cell.n_finished) == (N, 3, 2)
    errors = read_run(seeds)
    assert errors.counts()["failed"] == N
    error_m, percent = cumulative(errors.errors[:, 0].ravel())
    assert np.isfinite(error_m).all()
    assert percent[-1] == pytest.approx(100 * 2 / 3)
