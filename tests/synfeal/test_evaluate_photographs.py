"""``synfeal evaluate`` on photographs that other people's cameras took and programs posed."""

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from synfeal.evaluation.run import Settings, evaluate
from synfeal.evaluation.text import report_text
from tests.support.collected import refused

NUMBERS = (3, 4, 5, 9)
OFF_M, OFF_DEG = 0.05, 2.0


def pose_of(number):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.1 * number, -0.2, 0.3]).as_matrix()
    pose[:3, 3] = number, 0.5, -2.0
    return pose


def write_photograph(folder, number, pose, color="jpg"):
    folder.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (4, 3), "gray").save(folder / f"frame-{number:06d}.color.{color}")
    np.savetxt(folder / f"frame-{number:06d}.pose.txt", pose)


def write_estimates(path, names):
    """Poses that are off by a known position and angle, in an order of their own."""
    lines = ["image,tx,ty,tz,qw,qx,qy,qz"]
    for name, number in reversed(names):
        pose = pose_of(number)
        turned = Rotation.from_matrix(pose[:3, :3]) * Rotation.from_euler("z", OFF_DEG, True)
        x, y, z, w = turned.as_quat()
        values = [*(pose[:3, 3] + [0.0, OFF_M, 0.0]), w, x, y, z]
        lines.append(",".join([name, *map(repr, map(float, values))]))
    path.write_text("\n".join(lines) + "\n")
    return path


def check(dataset, poses):
    found = evaluate(dataset, poses, Settings())
    assert found.frames.split == "all"
    assert found.row.min() >= 0
    np.testing.assert_allclose(found.errors["position_m"], OFF_M, atol=1e-9)
    np.testing.assert_allclose(found.errors["orientation_deg"], OFF_DEG, atol=1e-5)


@pytest.mark.parametrize("color", ["jpg", "png"])
def test_a_flat_folder_is_scored_by_name(tmp_path, color):
    folder = tmp_path / "photos"
    for number in NUMBERS:
        write_photograph(folder, number, pose_of(number), color)
    names = [(f"photos/frame-{number:06d}.color.{color}", number) for number in NUMBERS]
    check(folder, write_estimates(tmp_path / "poses.csv", names))


def test_sequences_that_no_file_splits_are_scored_together(tmp_path):
    for number in NUMBERS:
        write_photograph(tmp_path / f"set/seq-{number:02d}", number, pose_of(number))
    names = [(f"set/seq-{n:02d}/frame-{n:06d}.color.jpg", n) for n in NUMBERS]
    check(tmp_path / "set", write_estimates(tmp_path / "poses.csv", names))


@pytest.mark.parametrize("split", [False, True])
def test_rotations_that_kinect_fusion_left_a_little_stretched_are_taken(tmp_path, split):
    folder = tmp_path / "set"
    for number in NUMBERS:
        pose = pose_of(number)
        pose[:3, :3] *= 1 + 1e-4
        write_photograph(folder / "seq-01", number, pose, "png")
    if split:
        (folder / "TestSplit.txt").write_text("sequence1\n")
        (folder / "TrainSplit.txt").write_text("")
    names = [(f"seq-01/frame-{number:06d}.color.png", number) for number in NUMBERS]
    found = evaluate(folder, write_estimates(tmp_path / "poses.csv", names), Settings())
    np.testing.assert_allclose(found.errors["position_m"], OFF_M, atol=1e-9)
    np.testing.assert_allclose(found.errors["orientation_deg"], OFF_DEG, atol=1e-5)


def test_a_photograph_without_pose_is_told(tmp_path, capfd):
    folder = tmp_path / "photos"
    for number in NUMBERS:
        write_photograph(folder, number, pose_of(number))
    names = [(f"frame-{number:06d}.color.jpg", number) for number in NUMBERS]
    poses = write_estimates(tmp_path / "poses.csv", names)
    (folder / "frame-000004.pose.txt").unlink()
    assert "frame-000004.pose.txt: missing" in refused(capfd, "evaluate", folder, poses)


def test_a_tum_sequence_without_images_is_named(tmp_path, capfd):
    for name in ("rgb.txt", "groundtruth.txt"):
        (tmp_path / name).write_text("# empty\n")
    poses = write_estimates(tmp_path / "poses.csv", [("frame-000003.color.jpg", 3)])
    assert "rgb.txt: lists no images" in refused(capfd, "evaluate", tmp_path, poses)


def test_photographs_that_localize_was_not_asked_about_are_left_out(tmp_path):
    folder = tmp_path / "photos"
    for number in NUMBERS:
        write_photograph(folder, number, pose_of(number))
    names = [(f"frame-{number:06d}.color.jpg", number) for number in NUMBERS[:2]]
    path = write_estimates(tmp_path / "poses.csv", names)
    header, *rows = path.read_text().splitlines()
    lost = f"frame-{NUMBERS[2]:06d}.color.jpg,,,,,,,,not localized,0,0.0"
    rows = [f"{row},localized,40,1.0" for row in rows]
    path.write_text("\n".join([f"{header},status,inliers,confidence", *rows, lost]) + "\n")
    found = evaluate(folder, path, Settings())
    assert [name[-6:] for name in found.frames.names] == [f"{n:06d}" for n in NUMBERS[:3]]
    assert found.frames.n_left_out == 1
    errors = found.errors["position_m"]
    np.testing.assert_allclose(errors, [OFF_M, OFF_M, np.inf], atol=1e-9)
    assert "1 further photographs are not in" in report_text(path, Settings(), found)
