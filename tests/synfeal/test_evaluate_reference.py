"""``synfeal evaluate`` against files of other people's poses, by other people's programs.

Two checkouts make the last tests run: ``SYNFEAL_TEST_PGT`` of
github.com/tsattler/visloc_pseudo_gt_limitations (of no commercial use) and ``SYNFEAL_TEST_EVO`` of
github.com/MichaelGrupp/evo.
"""

import json
import os
import re
import sys
import types
import zipfile
from pathlib import Path

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface

from synfeal.cli import main
from synfeal.evaluation.reference import MOST_APART_S, pairs_in_time
from synfeal.evaluation.run import Settings, evaluate
from tests.support import foreign_poses as foreign
from tests.support.collected import refused
from tests.support.property_support import random_table

COUNT = 2 * foreign.PER_SEQUENCE


@pytest.fixture(scope="module")
def truth():
    return random_table(COUNT, 3).world_from_cam


@pytest.fixture(scope="module")
def estimated(truth):
    return foreign.disturbed(truth, 0.1, 4.0)


def errors_of(truth, estimated):
    """Position errors in metres and angles in degrees, from matrices."""
    position_m = np.linalg.norm(truth[:, :3, 3] - estimated[:, :3, 3], axis=1)
    relative = np.swapaxes(truth[:, :3, :3], 1, 2) @ estimated[:, :3, :3]
    cosine = (np.trace(relative, axis1=1, axis2=2) - 1) / 2
    return position_m, np.degrees(np.arccos(cosine.clip(-1, 1)))


NAMED = ["hloc", "ACE", "ACE0", "pseudo ground truth", "synfeal localize"]


@pytest.mark.parametrize("reference_as", NAMED)
@pytest.mark.parametrize("written_as", NAMED)
def test_named_poses_are_paired_whatever_the_two_formats(
    truth, estimated, tmp_path, reference_as, written_as
):
    csv = "synfeal localize"
    reference = tmp_path / ("reference.csv" if reference_as == csv else "reference.txt")
    written = tmp_path / ("poses.csv" if written_as == csv else "poses.txt")
    foreign.WRITERS[reference_as](reference, truth)
    foreign.WRITERS[written_as](written, estimated)
    lines = written.read_text().splitlines()
    head = written_as == csv
    written.write_text("\n".join([*lines[:head], *reversed(lines[head + 1 :])]) + "\n")
    found = evaluate(reference, written, Settings())
    position_m, orientation_deg = errors_of(truth, estimated)
    position_m[0] = orientation_deg[0] = np.inf  # its line was cut
    np.testing.assert_allclose(found.errors["position_m"], position_m, atol=1e-9)
    np.testing.assert_allclose(found.errors["orientation_deg"], orientation_deg, atol=1e-5)


def test_lines_of_kitti_are_paired_one_by_one(truth, estimated, tmp_path, capsys):
    reference = foreign.write_kitti(tmp_path / "reference.txt", truth)
    poses = foreign.write_kitti(tmp_path / "poses.txt", estimated)
    found = evaluate(reference, poses, Settings())
    np.testing.assert_allclose(found.errors["position_m"], errors_of(truth, estimated)[0])
    foreign.write_kitti(poses, estimated[1:])
    line = refused(capsys, "evaluate", reference, poses)
    assert f"has {COUNT - 1} poses, the reference {COUNT}" in line


def write_tum(path, poses, stamps_s):
    trajectory = PoseTrajectory3D(poses_se3=list(poses), timestamps=np.asarray(stamps_s))
    file_interface.write_tum_trajectory_file(path, trajectory)
    return path


def test_times_are_paired_with_the_nearest_and_what_has_none_is_told(
    truth, estimated, tmp_path, capsys
):
    ns = 1403715524907143168 + 100_000_000 * np.arange(COUNT)
    reference = foreign.write_euroc(tmp_path / "data.csv", truth, ns)
    seconds = (ns[::2] - ns[0]) / 1e9 + 0.004 + 1403715524.907143168
    seconds[3] += 0.02  # too far from any
    poses = write_tum(tmp_path / "tum.txt", estimated[::2], seconds)
    found = evaluate(reference, poses, Settings())
    left = np.delete(np.arange(0, COUNT, 2), 3)
    expected = errors_of(truth[left], estimated[left])[0]
    np.testing.assert_allclose(found.errors["position_m"], expected, atol=1e-9)
    assert main(["evaluate", str(reference), str(poses)]) == 0
    printed = capsys.readouterr().out
    assert f"reference: {len(left)} frames, {len(left)} of them with a pose" in printed
    left_out = f"{COUNT - len(left)} poses of the reference have no estimate within 0.01 s"
    assert left_out in printed
    assert "1 poses of other frames are left out" in printed
    found = evaluate(reference, poses, Settings(labels=reference))
    np.testing.assert_allclose(found.errors["position_m_labels"], expected, atol=1e-9)


@pytest.mark.parametrize(("n_reference", "n_estimates"), [(50, 9), (9, 50), (1, 5), (5, 1)])
def test_pairs_are_those_of_evo(n_reference, n_estimates):
    rng = np.random.default_rng(n_reference)
    reference_s, estimate_s = (np.sort(rng.uniform(0, 0.5, n)) for n in (n_reference, n_estimates))
    longer, shorter = sorted((reference_s, estimate_s), key=len, reverse=True)
    expected = sync.matching_time_indices(shorter, longer, MOST_APART_S)
    chosen, row = pairs_in_time(reference_s, estimate_s)
    found = (row, chosen) if n_estimates <= n_reference else (chosen, row)
    assert [list(part) for part in found] == [list(part) for part in expected]


def test_euroc_poses_belong_to_frames_of_a_data_set_by_their_time(tmp_path):
    dataset, count = tmp_path / "set", foreign.PER_SEQUENCE
    truth = foreign.write_dataset(dataset)
    (dataset / "TrainSplit.txt").write_text("sequence1\nsequence2\n")
    (dataset / "TestSplit.txt").write_text("sequence3\n")
    ns = [round(number * 1e9 / foreign.RATE_HZ) for number in range(count)]
    poses = foreign.write_euroc(tmp_path / "data.csv", truth[count:], ns)
    found = evaluate(dataset, poses, Settings())
    assert found.metrics["position_m_max"] == pytest.approx(0, abs=1e-9)
    assert found.estimates.kind == "a EuRoC trajectory"


def test_commas_and_whole_seconds_are_read_as_the_format_that_is_named(
    truth, estimated, tmp_path, capsys
):
    """Eight whole columns are both formats', which order quaternions differently."""
    count = len(truth)
    spaced = write_tum(tmp_path / "tum.txt", estimated, range(count))
    commas = tmp_path / "commas.csv"
    lines = [line.partition(" ")[2].replace(" ", ",") for line in spaced.read_text().splitlines()]
    commas.write_text("".join(f"{second},{line}\n" for second, line in enumerate(lines)))
    reference = write_tum(tmp_path / "reference.txt", truth, range(count))
    line = refused(capsys, "evaluate", reference, commas)
    assert str(commas) in line
    assert "--format euroc or tum" in line
    found = evaluate(reference, commas, Settings(file_format="tum"))
    expected = errors_of(truth, estimated)
    np.testing.assert_allclose(found.errors["position_m"], expected[0], atol=1e-9)
    np.testing.assert_allclose(found.errors["orientation_deg"], expected[1], atol=1e-5)
    in_ns = foreign.write_euroc(tmp_path / "data.csv", estimated, 10**9 * np.arange(count))
    in_ns.write_text(re.sub(r",[^,\n]*$", "", in_ns.read_text(), flags=re.MULTILINE))
    assert "--format euroc or tum" in refused(capsys, "evaluate", reference, in_ns)
    found = evaluate(reference, in_ns, Settings(file_format="euroc"))
    np.testing.assert_allclose(found.errors["orientation_deg"], expected[1], atol=1e-5)


def numbered(lines, separator):
    """Lines whose names are numbers."""
    return [f"{i}{separator}{line.partition(separator)[2]}" for i, line in enumerate(lines)]


def test_a_numeric_name_needs_the_format(truth, estimated, tmp_path, capsys):
    reference = foreign.write_localized(tmp_path / "reference.csv", truth)
    header, *rows = reference.read_text().splitlines()
    reference.write_text("\n".join([header, *numbered(rows, ",")]))
    poses = foreign.write_hloc(tmp_path / "poses.txt", estimated)
    poses.write_text("\n".join(numbered(poses.read_text().splitlines(), " ")))
    line = refused(capsys, "evaluate", reference, poses)
    assert "is a TUM trajectory, whose poses have times" in line
    found = evaluate(reference, poses, Settings(file_format="hloc"))
    np.testing.assert_allclose(found.errors["position_m"], errors_of(truth, estimated)[0])
    line = refused(capsys, "evaluate", reference, poses, "--format", "pgt")
    assert "line 1 has 8 columns, pgt has 9" in line


def test_a_format_that_the_poses_are_not_in_is_told(truth, tmp_path, capsys):
    tree = foreign.write_tree(tmp_path / "tree", truth)
    reference = foreign.write_pgt(tmp_path / "reference.txt", truth)
    line = refused(capsys, "evaluate", reference, tree, "--format", "colmap")
    assert "is a 7-Scenes tree, not colmap" in line
    line = refused(capsys, "evaluate", reference, reference, "--format", "7scenes")
    assert "is a file; a 7scenes set of poses is a directory" in line


def test_a_reference_needs_each_pose_once_and_no_options_of_data_sets(truth, tmp_path, capsys):
    reference = foreign.write_pgt(tmp_path / "reference.txt", truth)
    poses = foreign.write_hloc(tmp_path / "poses.txt", truth)
    assert "--split: " in refused(capsys, "evaluate", reference, poses, "--split", "train")
    assert "--camera: " in refused(capsys, "evaluate", reference, poses, "--camera", poses)
    lines = reference.read_text().splitlines()
    reference.write_text("\n".join([*lines, lines[4]]))
    line = refused(capsys, "evaluate", reference, poses)
    assert f"'seq-02/frame-000004' has two poses, line 5 and line {COUNT + 1}" in line
    reference.write_text("\n".join([*lines[:4], "a.png 0 0 0 0 1 2 3 525.0"]))
    assert "line 5 is no rotation" in refused(capsys, "evaluate", reference, poses)


def checkout(variable):
    """The folder that an environment variable names."""
    if variable not in os.environ:
        pytest.skip(f"{variable} is not set")
    return Path(os.environ[variable])


@pytest.fixture
def pgt_util(monkeypatch):
    """The repository's own functions; what it reads depth images with is not needed here."""
    monkeypatch.syspath_prepend(str(checkout("SYNFEAL_TEST_PGT")))
    reader = types.ModuleType("skimage")
    reader.io = None
    monkeypatch.setitem(sys.modules, "skimage", reader)
    import evaluation_util

    return evaluation_util


SCENES = {
    "7scenes/heads": ("as", "hloc", "r2d2_rgb", "dsac_rgb"),
    "7scenes/stairs": ("as", "hloc", "r2d2_rgbd", "dsac_rgbd"),
    "12scenes/apt1_kitchen": ("as", "hloc", "dsac_rgb"),  # DSAC*'s lines have two numbers more
}


@pytest.mark.parametrize("labels", ["sfm", "dslam"])
@pytest.mark.parametrize("scene", SCENES)
def test_stored_estimates_have_the_errors_that_their_own_program_gives_them(
    pgt_util, scene, labels
):
    root = checkout("SYNFEAL_TEST_PGT")
    reference = root / f"pgt/{labels}/{scene}_test.txt"
    true = pgt_util.read_pose_data(reference)
    for method in SCENES[scene]:
        poses = root / f"estimates/{labels}/{scene}_{method}.txt"
        given = pgt_util.read_pose_data(poses)
        expected = [
            pgt_util.compute_error_max_rot_trans(pose, given[name][0]) if name in given else np.inf
            for name, (pose, _) in true.items()
        ]
        found = evaluate(reference, poses, Settings())
        joint = np.maximum(100 * found.errors["position_m"], found.errors["orientation_deg"])
        np.testing.assert_allclose(joint, expected, rtol=1e-6, atol=1e-4)
        recall = np.mean(np.array(expected) < 5)
        assert found.metrics["recall_5cm_5deg"] == pytest.approx(recall, abs=1e-12)


@pytest.mark.parametrize("method", ["orb", "sptam"])
def test_kitti_has_the_statistics_that_evo_stores(method):
    data = checkout("SYNFEAL_TEST_EVO") / "test/data"
    with zipfile.ZipFile(data / f"res_files/{method}_ape.zip") as stored:
        expected = json.loads(stored.read("stats.json"))
    poses = data / f"KITTI_00_{method.upper()}.txt"
    found = evaluate(data / "KITTI_00_gt.txt", poses, Settings(align="se3"))
    ours = {"median": "", "mean": "_mean", "rmse": "_rmse", "max": "_max"}
    for name, end in ours.items():
        assert found.metrics[f"position_m{end}"] == pytest.approx(expected[name], rel=1e-6)


TIMED = {
    ("V102_groundtruth.csv", "V102.txt"): "se3",
    ("fr2_desk_groundtruth.txt", "fr2_desk_ORB.txt"): "sim3",
    ("fr2_desk_groundtruth.txt", "fr2_desk_ORB_kf_mono.txt"): "sim3",
    ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam.txt"): "se3",
    ("freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-ORB_kf_mono.txt"): "sim3",
}


@pytest.mark.parametrize(("reference", "poses"), TIMED)
def test_trajectories_have_the_errors_that_evo_gives_them(reference, poses):
    data = checkout("SYNFEAL_TEST_EVO") / "test/data"
    align = TIMED[reference, poses]
    if reference.endswith(".csv"):
        true = file_interface.read_euroc_csv_trajectory(data / reference)
    else:
        true = file_interface.read_tum_trajectory_file(data / reference)
    given = file_interface.read_tum_trajectory_file(data / poses)
    true, given = sync.associate_trajectories(true, given, max_diff=MOST_APART_S)
    given.align(true, correct_scale=align == "sim3")
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((true, given))
    found = evaluate(data / reference, data / poses, Settings(align=align))
    assert len(found.errors["position_m"]) == len(ape.error)
    np.testing.assert_allclose(np.sort(found.errors["position_m"]), np.sort(ape.error), atol=1e-6)
