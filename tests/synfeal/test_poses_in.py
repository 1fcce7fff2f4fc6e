"""The one reader of trajectories: every pose of a line comes back, and each refusal is one line."""

import numpy as np
import pytest
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface

from synfeal.dataset.poses_in import read_pose_list, read_trajectory
from synfeal.errors import InputError
from tests.support.property_support import random_table

POSES = random_table(12, 0).world_from_cam
STAMPS_S = np.arange(12) / 30.0 + 1.5e9


@pytest.fixture
def path(tmp_path):
    """A trajectory by evo's writer."""
    file = tmp_path / "trajectory.txt"
    trajectory = PoseTrajectory3D(poses_se3=list(POSES), timestamps=STAMPS_S)
    file_interface.write_tum_trajectory_file(file, trajectory)
    return file


def test_poses_of_another_writer_come_back(path):
    found = read_trajectory(path)
    assert np.allclose(found.stamps_s, STAMPS_S, rtol=0, atol=1e-6)
    assert np.allclose(found.world_from_cam, POSES, rtol=0, atol=1e-9)


def test_both_readings_of_a_trajectory_agree(path):
    listed = read_pose_list(path)
    assert listed.kind == "a TUM trajectory"
    found = read_trajectory(path).world_from_cam
    assert np.array_equal(listed.world_from_cam(listed.convention), found)


def test_comments_blank_lines_and_a_byte_order_mark_are_passed_over(path):
    plain = read_trajectory(path).position_m
    lines = [f"{line}  # seen" for line in path.read_text().splitlines()]
    path.write_text("\ufeff# ground truth\n\n" + "\n\n".join(lines))
    assert np.array_equal(read_trajectory(path).position_m, plain)


def test_poses_are_put_in_order_of_time_and_one_that_is_written_twice_is_kept_once(path):
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[5:], *lines[:5], lines[3]]))
    found = read_trajectory(path)
    assert len(found) == 13
    ordered = found.by_time(path)
    assert np.array_equal(ordered.stamps_s, np.sort(found.stamps_s[:12]))
    assert np.allclose(ordered.world_from_cam, POSES, rtol=0, atol=1e-9)


def test_two_poses_of_one_time_are_refused(path):
    stamp, _, *others = path.read_text().splitlines()[3].split()
    with path.open("a") as file:
        file.write(f"\n{' '.join([stamp, '9', *others])}\n")
    with pytest.raises(InputError, match="two different poses"):
        read_trajectory(path).by_time(path)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("0 0 0 0 0 0 1", "line 2 must hold eight finite numbers: timestamp tx ty tz"),
        ("0 0 0 0 0 0 0 one", "line 2 must hold eight finite numbers"),
        ("0 nan 0 0 0 0 0 1", "line 2 must hold eight finite numbers"),
        ("0,0,0,0,0,0,0,1", "line 2 has commas; timestamp tx ty tz"),
        ("0 0 0 0 0 0 0 2", "line 2 holds a quaternion of length 2; a rotation has length 1"),
        ("0 0 1e12 0 0 0 0 1", "line 2 holds a position of 1e.12 m, which is no place"),
    ],
)
def test_a_line_that_is_no_pose_is_named(line, said, tmp_path):
    path = tmp_path / "groundtruth.txt"
    path.write_text(f"# of a robot\n{line}\n")
    with pytest.raises(InputError, match=rf"groundtruth\.txt: {said}"):
        read_trajectory(path)


@pytest.mark.parametrize(
    ("content", "said"), [(b"# none\n", "holds no poses"), (b"\xff\xfe", "not UTF-8")]
)
def test_a_file_without_a_trajectory_is_refused(content, said, tmp_path):
    (tmp_path / "poses.txt").write_bytes(content)
    with pytest.raises(InputError, match=rf"poses\.txt: .*{said}"):
        read_trajectory(tmp_path / "poses.txt")


def test_a_spreadsheet_of_another_country_is_told_from_other_text(tmp_path):
    """Its columns end in semicolons, and its numbers have commas."""
    path = tmp_path / "poses.csv"
    path.write_text("image;tx;ty;tz;qw;qx;qy;qz\na.png;0,5;1,25;2,0;1,0;0,0;0,0;0,0\n")
    with pytest.raises(InputError, match=r"poses\.csv: line 1 has semicolons between its columns"):
        read_pose_list(path)
