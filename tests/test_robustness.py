"""The robustness table, of answers that are known."""

import numpy as np
import pytest

from baselines.references.descriptors import write_descriptors
from baselines.references.robustness import SCHEMA, robustness_table
from synfeal.config.effects import CLEAN, MIXED
from synfeal.dataset.packed import new_packed
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.frames import read_frame
from synfeal.report.robustness import printed, robustness_sheet, write_robustness
from tests.trained_localizers import answering, save

PX = 32


def packed(path, frames):
    with new_packed(path, len(frames), PX) as array:
        array[:] = frames
    return path


def test_errors_are_those_of_known_answers(tmp_path):
    frames = np.random.default_rng(0).integers(0, 256, (4, PX, PX, 3), np.uint8)
    index, upright = np.arange(4), np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    train = PoseTable(index, index, np.column_stack([index, 0 * index, 0 * index]) * 1.0, upright)
    shown = np.array([1, 3])  # the test frames are these training frames
    test = PoseTable(index[:2], index[:2], train.position_m[shown], upright[:2])
    for name, table in (("train", train), ("test", test)):
        write_pose_table(tmp_path / f"{name}.csv", table)
    known = packed(tmp_path / "train.npy", frames)
    tests = {
        CLEAN: packed(tmp_path / "clean.npy", frames[shown]),
        "dark_2": packed(tmp_path / "dark.npy", frames[shown] // 2),
        "swapped_1": packed(tmp_path / "swapped.npy", frames[shown[::-1]]),
    }
    # Always at the origin, turned by a right angle about z: 1 m and 3 m away.
    constant = save(tmp_path / "m.pt", answering([0, 0, 0], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]))
    models = {CLEAN: {"posenet": constant}, MIXED: {"posenet": constant}}
    described = tmp_path / "described.npz"
    write_descriptors({"train": known, **tests}, 4, 0, described)
    # Structure answers for the second test frame alone: 0.5 m off, then not at all.
    answers = {CLEAN: tmp_path / "near.csv", "dark_2": tmp_path / "lost.csv"}
    off = test.position_m[1:] + np.array([0, 0.3, 0.4])
    write_pose_table(answers[CLEAN], PoseTable(index[1:2], index[1:2], off, upright[1:2]))
    lost = np.full((1, 3), np.nan), np.full((1, 4), np.nan)
    write_pose_table(answers["dark_2"], PoseTable(index[1:2], index[1:2], *lost))
    table = robustness_table(
        models, dict.fromkeys(models, described), answers, tests, tmp_path, "cpu"
    )

    found = table.set_index(["trained_on", "method", "effects"]).position_m.sort_index()
    for trained_on in models:
        nearest = found[trained_on, "nearest-thumbnail"]
        # Half the light changes nothing for vectors without mean and length; a swap is 2 m off.
        assert nearest.to_dict() == pytest.approx({CLEAN: 0, "dark_2": 0, "swapped_1": 2}, abs=1e-6)
        assert found[trained_on, "nearest-vlad", "swapped_1"] == pytest.approx(2)
        assert found[trained_on, "posenet"].tolist() == pytest.approx([2, 2, 2], abs=1e-4)
    assert found[CLEAN, "structure-depth"].to_dict() == pytest.approx(
        {CLEAN: 0.5, "dark_2": np.nan}, nan_ok=True
    )
    assert not (table.method[table.trained_on == MIXED] == "structure-depth").any()
    turned = table[table.method == "posenet"].orientation_deg
    assert turned.tolist() == pytest.approx([90] * 6, abs=1e-3)

    write_robustness(table, tmp_path / "r.csv", tmp_path / "r.tex")
    again = read_frame(tmp_path / "r.csv", SCHEMA)
    assert again.n_test.groupby(again.method).first().to_dict() == {
        **{"nearest-thumbnail": 2, "nearest-vlad": 2, "posenet": 2},
        "structure-depth": 1,
    }
    sheet = robustness_sheet(again)
    assert "1 of the 2 test frames" in sheet.remarks[0]
    assert [printed(v, 2) for v in (1.234, 0.1, 0.00212)] == ["1.23", "0.10", "0.0021"]
    assert sheet.lines.groupby("block", sort=False).size().tolist() == [3, 3]
    assert sheet.lines.label[1] == "dark, strength 2"
    assert "swapped, strength 1" in (tmp_path / "r.tex").read_text()
