"""Differences between two label sets of real frames: what is taken off, and correlations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.label_differences import correlation, frames_apart, rows_of_scene
from synfeal.geometry.poses import inverse
from tests.support.property_support import pose_of, random_poses, turn

CAMERA = pose_of([0.0255, 0.0, -0.002], turn([1.0, 0.0, 0.0], 0.01))  # depth_from_color
WORLD = pose_of([0.3, -0.2, 0.1], turn([0.0, 0.0, 1.0], 0.2))


def write_poses(path, frames, world_from_cam):
    """The repository's files: name, ``cam_from_world``, focal length."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = []
    for number, pose in enumerate(inverse(world_from_cam)[frames], start=frames.start):
        quat = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True)
        cells = [f"{cell:.12f}" for cell in (*quat, *pose[:3, 3])]
        lines.append(f"seq-01/frame-{number:06d}.color.png {' '.join(cells)} 525.0")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_worlds_and_cameras_are_taken_off_one_after_the_other(tmp_path):
    of_depth = random_poses(0, 60)
    of_color = WORLD @ of_depth @ CAMERA
    for source, two, one in (("dslam", of_depth, of_depth), ("sfm", of_color, WORLD @ of_depth)):
        for split, frames in (("train", slice(0, 30)), ("test", slice(30, 60))):
            write_poses(tmp_path / source / f"7scenes/room_{split}.txt", frames, two)
            write_poses(tmp_path / source / f"12scenes/room_{split}.txt", frames, one)
    rows = {row["removed"]: row for row in rows_of_scene(tmp_path, "7scenes", "room", CAMERA)}
    assert [*rows] == ["nothing", "worlds", "worlds and cameras"]
    assert rows["nothing"]["position_m"] > 0.1
    assert rows["nothing"]["orientation_deg"] == pytest.approx(np.degrees(0.2), abs=1.0)
    assert 0.001 < rows["worlds"]["position_m"] < 0.0256
    assert rows["worlds and cameras"]["position_m"] == pytest.approx(0, abs=1e-9)
    assert rows["worlds and cameras"]["orientation_deg"] == pytest.approx(0, abs=1e-6)
    nothing, worlds = rows_of_scene(tmp_path, "12scenes", "room", CAMERA)
    assert nothing["orientation_deg"] == pytest.approx(np.degrees(0.2), abs=1e-6)
    assert nothing["orientation_correlation_25"] == pytest.approx(1, abs=1e-9)
    assert worlds["position_m"] == pytest.approx(0, abs=1e-9)


def test_pairs_stay_within_a_sequence_and_count_frames_that_are_missing():
    sequence = np.array(["a", "a", "a", "b", "b"])
    number = np.array([3, 4, 6, 5, 8])
    pairs = {lag: np.array(frames_apart(sequence, number, lag)).T.tolist() for lag in (1, 2, 3, 9)}
    assert pairs == {1: [[0, 1]], 2: [[1, 2]], 3: [[0, 2], [3, 4]], 9: []}


def test_a_wave_is_correlated_by_its_cosine():
    frame = np.arange(3600)
    wave = np.array([np.sin(frame / 20), np.cos(frame / 20), 0 * frame]).T
    pairs = frames_apart(np.full(len(frame), "a"), frame, 25)
    assert correlation(wave, *pairs) == pytest.approx(np.cos(25 / 20), abs=1e-9)
