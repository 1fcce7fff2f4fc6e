"""``synfeal evaluate`` against evo's numbers, on files other programs wrote, and on bad ones."""

import re

import numpy as np
import pandas as pd
import pytest
from evo.core.metrics import APE, PoseRelation
from evo.core.trajectory import PosePath3D

from synfeal.cli import main
from synfeal.errors import InputError
from synfeal.evaluation.run import Settings, evaluate
from tests.support import foreign_poses as foreign
from tests.support.collected import refused

SIMILARITY = (1.7, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), [3.0, -2.0, 5.0])


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("evaluate") / "set"
    foreign.write_dataset(folder)
    return folder


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    return foreign.write_dataset(tmp_path_factory.mktemp("truth"))


@pytest.fixture(scope="module")
def estimated(truth):
    return foreign.disturbed(truth, 0.1, 4.0)


def evo_errors(truth, poses, align="none"):
    """Errors of each frame by evo's own code."""
    reference, estimate = PosePath3D(poses_se3=list(truth)), PosePath3D(poses_se3=list(poses))
    if align != "none":
        estimate.align(reference, correct_scale=align == "sim3")
    relations = {
        "position_m": PoseRelation.translation_part,
        "orientation_deg": PoseRelation.rotation_angle_deg,
    }
    errors = {}
    for name, relation in relations.items():
        ape = APE(relation)
        ape.process_data((reference, estimate))
        errors[name] = ape.error
        errors |= {f"{name}_{key}": value for key, value in ape.get_all_statistics().items()}
    return errors


@pytest.mark.parametrize("align", ["none", "se3", "sim3"])
@pytest.mark.parametrize("written_as", foreign.WRITERS)
def test_errors_are_evos_whatever_the_file(dataset, truth, estimated, tmp_path, written_as, align):
    poses = estimated.copy()
    if align != "none":  # the same trajectory in a world of another origin, heading and scale
        scale, rotation, translation = SIMILARITY
        scale = 1.0 if align == "se3" else scale
        poses[:, :3, 3] = (scale * estimated[:, :3, 3]) @ rotation.T + translation
        poses[:, :3, :3] = rotation @ estimated[:, :3, :3]
    written = foreign.WRITERS[written_as](tmp_path / "poses", poses)
    written = written.rename(written.with_suffix(".csv")) if "table" in written_as else written
    found = evaluate(dataset, written, Settings(align=align))
    expected = evo_errors(truth, poses, align)
    # pose.txt has ten decimals: 1e-10 of a matrix entry is 1e-8 degrees, and more where it adds up.
    decimals = written_as == "7-Scenes"
    for name, rounded in {"position_m": 2e-9, "orientation_deg": 1e-7}.items():
        atol = rounded if decimals else 1e-9
        np.testing.assert_allclose(found.errors[name], expected[name], rtol=0, atol=atol)
        for ours, theirs in {"": "median", "_mean": "mean", "_rmse": "rmse", "_max": "max"}.items():
            assert found.metrics[name + ours] == pytest.approx(
                expected[f"{name}_{theirs}"], rel=0, abs=atol
            )


def test_what_is_missing_or_no_rotation_counts_as_an_error_and_is_told(
    dataset, estimated, tmp_path, capsys
):
    lines = foreign.write_hloc(tmp_path / "poses.txt", estimated).read_text().splitlines()
    name, *numbers = lines[4].split()
    lines[4] = " ".join([name, "0.5 0 0 0", *numbers[4:]])  # half a quaternion
    lines[5] = f"{lines[5].split()[0]} nan nan nan nan nan nan nan"
    extra = lines[6].replace("seq-02", "seq-01")
    (tmp_path / "poses.txt").write_text("\n".join([*lines[:10], *lines[12:], extra]) + "\n")
    out = tmp_path / "out"
    assert main(["evaluate", str(dataset), str(tmp_path / "poses.txt"), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    for words in (
        "an hloc result file, 23 poses, taken as cam_from_world with quaternions wxyz",
        "24 frames, 21 of them with a pose",
        "without a pose, which counts as a failure: seq-02/frame-000005, seq-02/frame-000010,"
        " seq-02/frame-000011\n",
        "no rotation, which counts likewise: seq-02/frame-000004\n",
        "1 poses of other frames are left out",
    ):
        assert words in printed
    errors = pd.read_csv(out / "errors.csv")
    lost = np.isinf(errors["position_m"]).to_numpy().nonzero()[0].tolist()
    assert lost == [4, 5, 10, 11]
    scores = pd.read_csv(out / "scores.csv").set_index("score")["value"]
    ok = (errors["position_m"] < 0.5) & (errors["orientation_deg"] < 15)
    assert scores["recall_50cm_15deg"] == pytest.approx(ok.mean())
    assert scores["position_m"] == pytest.approx(np.median(errors["position_m"]))
    assert (out / "errors.png").stat().st_size > 10_000


def test_a_picture_that_is_no_frame_is_left_out_and_told(dataset, truth, tmp_path, caplog, capsys):
    poses = foreign.write_localized(tmp_path / "poses.csv", truth)
    poses.write_text(poses.read_text() + "photos/IMG_2041.jpg,0,0,0,1,0,0,0\n")
    assert main(["evaluate", str(dataset), str(poses)]) == 0
    assert "'photos/IMG_2041.jpg' names no frame" in caplog.text
    printed = capsys.readouterr().out
    assert "24 frames, 24 of them with a pose" in printed
    assert "1 poses of other frames are left out" in printed


def test_training_frames_are_scored_where_there_are_no_others(truth, tmp_path, caplog):
    folder = tmp_path / "set"
    foreign.write_dataset(folder)
    test, train = folder / "TestSplit.txt", folder / "TrainSplit.txt"
    train.write_text(test.read_text())
    test.write_text("")
    poses = foreign.write_localized(tmp_path / "poses.csv", truth)
    found = evaluate(folder, poses, Settings())
    assert found.errors["position_m"].max() == pytest.approx(0.0, abs=1e-9)
    assert "has no test frames, so its training frames are scored" in caplog.text


def test_a_file_of_which_nothing_was_localized_says_so(dataset, truth, tmp_path, capsys):
    lines = foreign.write_localized(tmp_path / "poses.csv", truth).read_text().splitlines()
    header, *rows = lines
    empty = [f"{row.partition(',')[0]},,,,,,,,not localized,0,0" for row in rows]
    (tmp_path / "poses.csv").write_text(
        "\n".join([f"{header},status,inliers,confidence", *empty]) + "\n"
    )
    line = refused(capsys, "evaluate", dataset, tmp_path / "poses.csv")
    assert line.endswith("poses.csv: holds no pose of these frames, none of them was localized")


def test_labels_are_a_second_yardstick_and_a_swapped_convention_is_noticed(
    dataset, truth, estimated, tmp_path, capsys
):
    labels = foreign.disturbed(truth, 0.3, 20.0, seed=5)
    settings = Settings(labels=foreign.write_tree(tmp_path / "labels", labels))
    found = evaluate(dataset, foreign.write_ace(tmp_path / "ace.txt", estimated), settings)
    for end, reference in {"": truth, "_labels": labels}.items():
        expected = evo_errors(reference, estimated)
        np.testing.assert_allclose(
            found.errors[f"position_m{end}"], expected["position_m"], rtol=0, atol=2e-9
        )
    swapped = foreign.write_ace(tmp_path / "ace.txt", np.linalg.inv(estimated))
    assert re.search("as world_from_cam-wxyz.*--convention", refusal(capsys, dataset, swapped))
    found = evaluate(dataset, swapped, Settings(convention="world_from_cam-wxyz"))
    assert found.metrics["position_m"] < 0.5


def lines_of(write, name=""):
    return lambda folder, poses: (write(folder / "w", poses) / name).read_text().splitlines()


HLOC, ACE = lines_of(foreign.write_hloc), lines_of(foreign.write_ace)
TUM = lines_of(foreign.write_tum, "seq-02.txt")
TABLE, LOCALIZED = lines_of(foreign.write_table), lines_of(foreign.write_localized)


def with_line(at, line):
    return lambda lines: [*lines[:at], line, *lines[at + 1 :]]


def cut(at, columns):
    return lambda lines: with_line(at, " ".join(lines[at].split()[:columns]))(lines)


def each(change):
    return lambda lines: [change(line) for line in lines]


IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0"
BAD_LINES = {
    "ACE, a column short": (ACE, cut(5, 10), "line 6 has 10 columns, those above 11"),
    "word for a number": (HLOC, each(lambda x: x[:-3] + "abc"), "is not a number"),
    "decimal commas": (ACE, each(lambda x: re.sub(r"(?<=\d)\.(?=\d)", ",", x)), "is not a number"),
    "empty": (HLOC, lambda _: [], "holds no poses"),
    "no rotation": (HLOC, each(lambda x: f"{x.split()[0]} 0 0 0 0 1 2 3"), "is a rotation and"),
    "no frame in names": (HLOC, each(lambda x: f"cat.jpg {x.split(None, 1)[1]}"), "no frame"),
    "no sequence": (HLOC, each(lambda x: x.partition("/")[2]), "does not say of which sequence"),
    "twice": (HLOC, lambda x: [*x, x[4]], "seq-02/frame-000004 has two poses, line 5 and line 25"),
    "of another data set": (HLOC, each(lambda x: x.replace("seq-0", "seq-4")), "none of its 24"),
    "KITTI, a line short": (HLOC, lambda _: [IDENTITY] * 23, "without their names"),
    "KITTI, no rotations": (HLOC, lambda _: [IDENTITY.replace("1", "2")] * 24, "is a rotation and"),
    "eleven numbers": (HLOC, lambda _: [IDENTITY[:-2]] * 24, "line 1 has 11 numbers and no name"),
    "pgt, a focal length in words": (
        HLOC,
        each(lambda x: f"{x} wide"),
        "line 1: 'wide' is not a number",
    ),
    "EuRoC in seconds": (
        HLOC,
        lambda _: ["1403715524.9,0,0,0,1,0,0,0"] * 24,
        "must be whole nanoseconds",
    ),
    "TUM or EuRoC": (
        HLOC,
        lambda _: [f"{i},0,0,0,0,0,0,1" for i in range(24)],
        "say which with --format euroc or tum",
    ),
    "EuRoC, a column short": (HLOC, lambda _: ["#t", "14,0,0,0,1,0,0"], "line 2 has 7 columns"),
    "TUM of two sequences": (TUM, lambda x: x, "do not say of which sequence"),
    "table, other header": (TABLE, with_line(0, "frame,x,y,z"), "the header must be"),
    "table, half a frame": (TABLE, with_line(2, "1.5,0,0,0,0,1,0,0,0"), "must be a whole number"),
    "table, a row short": (TABLE, with_line(2, "1,0,0,0,0,1,0,0"), "row 3: has 8 cells where"),
    "table, after a blank line": (
        TABLE,
        lambda x: [*x[:2], "", "1,0,0,0,0,one,0,0,0", *x[3:]],
        "row 4: qw must be a number, found 'one'",
    ),
    "table, too long": (TABLE, lambda x: [*x, "99,0,0,0,0,1,0,0,0"], "frame 99 does not exist"),
    "quaternions xyzw": (
        HLOC,
        each(lambda x: " ".join([(c := x.split())[0], *c[2:5], c[1], *c[5:]])),
        "as cam_from_world-xyzw",
    ),
}


@pytest.mark.parametrize("case", BAD_LINES)
def test_a_malformed_file_is_refused_in_one_line(dataset, estimated, tmp_path, capsys, case):
    write, damage, words = BAD_LINES[case]
    bad = tmp_path / "poses"
    bad.write_text("".join(f"{line}\n" for line in damage(write(tmp_path, estimated))))
    assert words in refusal(capsys, dataset, bad)


def refusal(capsys, dataset, bad, *more):
    line = refused(capsys, "evaluate", dataset, bad, *more)
    assert str(bad) in line
    return line


def binary_garbage(folder, poses):
    (folder / "poses.txt").write_bytes(b"\xff\xfe\x00\x01" * 40)
    return folder / "poses.txt"


def model_twice(folder, poses):
    model = foreign.write_colmap(folder / "model", poses, binary=True)
    foreign.write_colmap(folder / "text", poses, binary=False)
    (folder / "text/images.txt").rename(model / "images.txt")
    return model


def model_cut(folder, poses):
    model = foreign.write_colmap(folder / "model", poses, binary=True)
    data = (model / "images.bin").read_bytes()
    (model / "images.bin").write_bytes(data[: len(data) // 2])
    return model


def tree_of_three_rows(folder, poses):
    tree = foreign.write_tree(folder / "tree", poses)
    (tree / "seq-02/frame-000003.pose.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n")
    return tree


BAD_PATHS = {
    binary_garbage: "cannot be read as poses",
    model_twice: "images.txt and images.bin",
    model_cut: "cannot be read as a COLMAP model",
    tree_of_three_rows: "four rows of four",
}


@pytest.mark.parametrize("make", BAD_PATHS, ids=lambda make: make.__name__)
def test_a_malformed_place_is_refused_in_one_line(dataset, estimated, tmp_path, capsys, make):
    assert BAD_PATHS[make] in refusal(capsys, dataset, make(tmp_path, estimated))


def test_incomplete_labels_and_points_on_a_line_are_refused(dataset, truth, tmp_path, capsys):
    labels = foreign.write_tree(tmp_path / "labels", truth)
    (labels / "seq-03/frame-000002.pose.txt").unlink()
    line = truth.copy()
    line[:, :3, 3] = np.arange(len(line))[:, None] * [1.0, 2.0, 3.0]
    poses = foreign.write_hloc(tmp_path / "poses.txt", line)
    line = refused(capsys, "evaluate", dataset, poses, "--labels", labels)
    assert "has no pose of seq-03/frame-000002" in line
    assert "cannot be aligned" in refusal(capsys, dataset, poses, "--align", "se3")


def test_frames_are_found_by_their_numbers_where_there_is_one_sequence(tmp_path):
    """Numbered time stamps, and names without a sequence, of a split with one sequence."""
    dataset, count = tmp_path / "set", foreign.PER_SEQUENCE
    truth = foreign.write_dataset(dataset)
    (dataset / "TrainSplit.txt").write_text("sequence1\nsequence2\n")
    (dataset / "TestSplit.txt").write_text("sequence3\n")
    names = [line.partition("/")[2] for line in HLOC(tmp_path, truth)[count:]]
    (tmp_path / "hloc.txt").write_text("\n".join(names))
    rows = [line.split(",") for line in TABLE(tmp_path, truth[count:])[1:]]
    lines = [" ".join([r[0], *r[2:5], *r[6:], r[5]]) for r in rows]
    (tmp_path / "tum.txt").write_text("\n".join(lines))
    for name, rate in {"hloc.txt": None, "tum.txt": 1.0}.items():
        found = evaluate(dataset, tmp_path / name, Settings(rate_hz=rate))
        assert found.metrics["position_m_max"] == pytest.approx(0, abs=1e-9)
        assert found.frames.names[0] == "seq-03/frame-000000"
        assert len(found.frames.names) == count
    with pytest.raises(InputError, match=r"0, 1, 2, .* give `rate_hz=1`"):
        evaluate(dataset, tmp_path / "tum.txt", Settings())
    with pytest.raises(InputError, match=r"^rate_hz: .*hloc.txt .* without times"):
        evaluate(dataset, tmp_path / "hloc.txt", Settings(rate_hz=30.0))


@pytest.mark.parametrize("write", [foreign.write_tree, foreign.write_kitti])
def test_matrices_have_no_order_of_quaternions(dataset, truth, tmp_path, write):
    poses = write(tmp_path / "poses", truth)
    with pytest.raises(InputError, match=r"^convention: .* of matrices"):
        evaluate(dataset, poses, Settings(convention="world_from_cam-xyzw"))
    inverse = write(tmp_path / "inverse", np.linalg.inv(truth))
    found = evaluate(dataset, inverse, Settings(convention="cam_from_world-wxyz"))
    assert found.metrics["position_m_max"] == pytest.approx(0, abs=1e-6)
    assert found.metrics["orientation_deg_max"] == pytest.approx(0, abs=1e-4)
