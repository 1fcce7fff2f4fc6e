"""Scores on photographs: labels of two sources, blocks of neighbours, limits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from reproduction.real.labels import (
    gauge_between,
    label_difference,
    motion_of,
    of_depth_camera,
    read_sfm_labels,
)
from reproduction.real.scores import (
    Draws,
    Errors,
    Truth,
    cell,
    correlation_frames,
    photograph_name,
    read_errors,
    times_as_exact,
)
from reproduction.real.split import blocks_of, directions_of, split_frames, spread, write_frames
from reproduction.real.stages import mean_pose
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.dataset.sevenscenes import pose_text
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix, quat_wxyz_of


def some_poses(count, seed=0):
    rng = np.random.default_rng(seed)
    rotations = Rotation.from_rotvec(rng.normal(size=(count, 3))).as_matrix()
    return np.stack(
        [pose_matrix(r, p) for r, p in zip(rotations, rng.normal(size=(count, 3)), strict=True)]
    )


def names_of(numbers, sequence="seq-01"):
    return [f"{sequence}/frame-{number:06d}" for number in numbers]


# Blocks and parts of a sequence


def test_blocks_end_where_frames_are_not_neighbours():
    names = names_of([0, 1, 2, 3, 10, 11, 12, 13]) + names_of([14, 15], "seq-02")
    assert blocks_of(names, 2).tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]


def test_blocks_are_of_nearly_equal_length_and_none_is_a_remainder():
    sizes = np.bincount(blocks_of(names_of(range(500, 605)), 50))
    assert sizes.sum() == 105
    assert sizes.tolist() == [53, 52]


@pytest.fixture
def sequence(tmp_path):
    folder = tmp_path / "flat"
    folder.mkdir()
    for number, pose in enumerate(some_poses(40)):
        (folder / f"frame-{number:06d}.color.png").write_bytes(b"no image is opened")
        (folder / f"frame-{number:06d}.pose.txt").write_text(pose_text(pose))
    return folder


def numbers(frames):
    return [int(name[-6:]) for name in frames.names]


def test_halves_and_tenths_hold_every_photograph_once(sequence):
    assert directions_of(sequence) == ("forward", "reverse", "alternate")
    forward, backward, tenths = (split_frames(sequence, d) for d in directions_of(sequence))
    assert (numbers(forward[0]), numbers(forward[1])) == ([*range(20)], [*range(20, 40)])
    assert (numbers(backward[0]), numbers(backward[1])) == ([*range(20, 40)], [*range(20)])
    scanned, tested = map(numbers, tenths)
    assert sorted(scanned + tested) == [*range(40)]
    assert scanned[:8] == [0, 1, 2, 3, 8, 9, 10, 11]


def test_the_official_split_is_used_where_all_its_sequences_are_there(sequence, tmp_path):
    scene = tmp_path / "scene"
    frames = read_posed_sequence(sequence)
    write_frames(replace(frames[:8], names=tuple(names_of(range(8), "seq-02"))), "", scene)
    (scene / "TrainSplit.txt").write_text("sequence1\n")
    (scene / "TestSplit.txt").write_text("sequence2\n")
    assert directions_of(scene) == ("forward", "reverse", "alternate")  # seq-01 is not there
    write_frames(frames[8:], "seq-01", tmp_path / "more")
    (tmp_path / "more" / "seq-01").rename(scene / "seq-01")
    assert directions_of(scene) == ("official",)
    train, test = split_frames(scene, "official")
    assert (len(train), len(test)) == (32, 8)
    assert {name[:6] for name in test.names} == {"seq-02"}


def test_fewer_photographs_are_spread_over_all(sequence):
    frames = read_posed_sequence(sequence)
    assert numbers(spread(frames, 4)) == [0, 10, 20, 30]
    assert len(spread(frames, None)) == len(spread(frames, 99)) == 40


def test_too_few_photographs_are_refused_in_one_line(sequence):
    for number in range(10, 40):
        for file in sequence.glob(f"frame-{number:06d}.*"):
            file.unlink()
    with pytest.raises(InputError, match="holds 10 photographs; 20 or more"):
        split_frames(sequence, "forward")


# Labels of two sources


def test_the_gauge_between_two_worlds_is_found_exactly_also_on_a_straight_path():
    """Camera centres on a line say nothing of the rotation about it; rotations do."""
    poses = some_poses(12)
    poses[:, :3, 3] = np.linspace(0, 3, 12)[:, None] * [1.0, 2.0, 0.5]
    motion = some_poses(1, seed=9)[0]
    gauge = gauge_between(np.linalg.inv(motion) @ poses, poses)
    np.testing.assert_allclose(gauge.to_from_other, motion, atol=1e-9)
    assert gauge.scale == pytest.approx(1.0)
    found = label_difference(poses, np.linalg.inv(motion) @ poses, gauge)
    assert found["position_m_max"] < 1e-9
    assert found["orientation_deg_max"] < 1e-5


def test_the_scale_of_another_world_is_told_and_not_applied():
    poses = some_poses(30)
    small = poses.copy()
    small[:, :3, 3] *= 0.5
    gauge = gauge_between(small, poses)
    assert gauge.scale == pytest.approx(2.0)
    np.testing.assert_allclose(gauge.to_from_other[:3, :3], np.eye(3), atol=1e-9)


def test_a_point_seen_by_the_colour_camera_is_where_the_depth_camera_sees_it():
    depth_from_color = motion_of((1.0, -2.0, 0.5, 0.03, 0.01, -0.02))
    world_from_color = some_poses(3)
    in_color = np.array([0.3, -0.2, 2.0, 1.0])
    in_depth = depth_from_color @ in_color
    np.testing.assert_allclose(
        of_depth_camera(world_from_color, depth_from_color) @ in_depth,
        world_from_color @ in_color,
        atol=1e-12,
    )


def test_labels_by_sfm_are_read_as_cam_from_world(tmp_path):
    """A camera at (1, 2, 3) that looks along world x: its z axis is x, so p_cam = R p + t."""
    file = tmp_path / "room_train.txt"
    turn = Rotation.from_matrix([[0, -1, 0], [0, 0, -1], [1, 0, 0]])  # cam_from_world
    x, y, z, w = turn.as_quat()
    t = -turn.as_matrix() @ [1.0, 2.0, 3.0]
    cells = " ".join(f"{v:.6f}" for v in (w, x, y, z, *t, 525.5))
    file.write_text(f"seq-01/frame-000007.color.png {cells}\n")
    pose = read_sfm_labels([file])["seq-01/frame-000007"]
    np.testing.assert_allclose(pose[:3, 3], [1, 2, 3], atol=1e-5)
    np.testing.assert_allclose(pose[:3, 2], [1, 0, 0], atol=1e-5)


def test_what_is_no_label_by_sfm_is_told_with_its_line(tmp_path):
    file = tmp_path / "labels.txt"
    file.write_text("seq-01/frame-000000.color.png 1 0 0 0 0 0 0 525\nseq-01/frame-000001 1 2\n")
    with pytest.raises(InputError, match=r"labels\.txt: line 2"):
        read_sfm_labels([file])


# Scores


def write_poses(path, names, poses, lost=()):
    lines = ["image,tx,ty,tz,qw,qx,qy,qz,status,inliers,confidence"]
    for index, (name, pose) in enumerate(zip(names, poses, strict=True)):
        cells = [*pose[:3, 3], *quat_wxyz_of(pose)]
        text = ",".join("" if index in lost else repr(float(cell)) for cell in cells)
        status = "not localized" if index in lost else "localized"
        lines.append(f"/somewhere/test/{name}.color.png,{text},{status},12,0.999")
    path.write_text("\n".join(lines) + "\n")


def test_poses_are_paired_by_name_and_a_photograph_that_is_not_localized_counts(tmp_path):
    names, poses = names_of(range(6)), some_poses(6)
    moved = poses.copy()
    moved[:, 0, 3] += np.arange(6) / 100
    order = [3, 1, 0, 5, 4, 2]
    write_poses(tmp_path / "poses.csv", [names[i] for i in order], moved[order], lost=(3,))
    errors = read_errors(tmp_path / "poses.csv", Truth(tuple(names), poses))
    np.testing.assert_allclose(errors.position_m, [0, 0.01, 0.02, 0.03, 0.04, np.inf], atol=1e-5)
    np.testing.assert_array_equal(errors.recalled, [1, 1, 1, 1, 1, 0])
    np.testing.assert_array_equal(errors.localized, [1, 1, 1, 1, 1, 0])


def test_a_photograph_without_a_line_is_refused(tmp_path):
    names, poses = names_of(range(3)), some_poses(3)
    write_poses(tmp_path / "poses.csv", names[:2], poses[:2])
    with pytest.raises(InputError, match="has no line for seq-01/frame-000002"):
        read_errors(tmp_path / "poses.csv", Truth(tuple(names), poses))


def test_a_photograph_is_called_by_its_sequence_and_number():
    assert photograph_name("/x/test/seq-03/frame-000012.color.png") == "seq-03/frame-000012"


@pytest.fixture
def walk():
    """400 photographs in 20 blocks of neighbours, and two runs on them."""
    names = names_of(range(400))
    rng = np.random.default_rng(4)
    of_block = np.repeat(rng.lognormal(-2, 0.5, 20), 20)
    runs = [Errors(of_block * rng.lognormal(0, 0.1, 400), 30 * of_block) for _ in range(2)]
    return names, runs


def test_a_cell_is_the_mean_over_seeds_of_medians_and_its_limits_hold_it(walk):
    names, runs = walk
    found = cell(runs, Draws(names, 20))
    medians = [np.median(run.position_m) for run in runs]
    assert found["position_m"] == pytest.approx(np.mean(medians))
    assert found["position_m_worst"] == pytest.approx(max(medians))
    assert found["position_m_low"] < found["position_m"] < found["position_m_high"]


def test_limits_over_blocks_are_wider_than_over_single_photographs(walk):
    """Neighbours tell nearly the same: 400 photographs of 20 blocks are no 400 observations."""
    names, runs = walk
    widths = []
    for block_frames in (20, 1):
        found = cell(runs[:1], Draws(names, block_frames))
        widths.append(found["position_m_high"] - found["position_m_low"])
    assert widths[0] > 2 * widths[1]


def test_half_the_error_everywhere_is_twice_as_exact_without_doubt(walk):
    """Draws are paired: what one set of blocks does to both cancels; other runs are not known."""
    names, runs = walk
    runs = runs[:1]
    half = [Errors(run.position_m / 2, run.orientation_deg / 4) for run in runs]
    found = times_as_exact(half, runs, Draws(names, 20))
    for name, factor in (("position", 2), ("orientation", 4)):
        values = [found[f"times_{name}{end}"] for end in ("", "_low", "_high")]
        np.testing.assert_allclose(values, factor, rtol=1e-9)


def test_the_correlation_of_a_first_order_process_is_its_closed_form():
    """It is (1 + a) / (1 - a) of x[k] = a x[k-1] + noise, and 1 of independent errors."""
    rng = np.random.default_rng(2)
    for a in (0.0, 0.5, 0.8):
        x = np.empty(60_000)
        x[0] = 0
        noise = rng.standard_normal(len(x))
        for k in range(1, len(x)):
            x[k] = a * x[k - 1] + noise[k]
        found = correlation_frames([Errors(np.exp(0.2 * x), x)])
        assert found == pytest.approx((1 + a) / (1 - a), rel=0.15)


def test_the_mean_pose_of_cameras_about_one_is_that_one():
    centre = some_poses(1)[0]
    around = []
    for axis in np.eye(3):
        for sign in (-1, 1):
            turn = Rotation.from_rotvec(sign * 0.3 * axis).as_matrix()
            around.append(pose_matrix(centre[:3, :3] @ turn, centre[:3, 3] + sign * axis))
    np.testing.assert_allclose(mean_pose(np.stack(around)), centre, atol=1e-9)


def test_labels_of_a_file_that_is_not_there_are_told(tmp_path):
    with pytest.raises(InputError, match="nothing"):
        read_sfm_labels([Path(tmp_path / "nothing.txt")])
