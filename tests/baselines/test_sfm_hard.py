"""Batches that structure from motion finds hard: each ends with a stated result, in bounded time.

Frames are ray-cast in closed form (``tests/support/room_scene.py``).
"""

import itertools
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from baselines.config.labels import SfmConfig
from baselines.labels.chain import fill_gaps
from baselines.labels.sfm import mapping, metric_scale, sfm_batch
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, pose_matrix, relative
from synfeal.geometry.rotations import rotation_from_rpy
from tests.support.room_scene import painted, random_texture

CAMERA = CameraConfig(width=160, height=120, horizontal_fov_deg=70.0)
CFG = SfmConfig(max_features=300, peak_threshold=0.002, overlap=3)
RNG = np.random.default_rng(0)
ROOM = [random_texture(RNG) for _ in range(6)]


def poses_at(position_m, yaw_deg):
    """World poses of a camera at positions (n, 3) that looks along yaw (n,), slightly down."""
    yaw = np.radians(np.broadcast_to(yaw_deg, len(position_m)))
    rpy = np.column_stack([0 * yaw, 0 * yaw + 0.1, yaw])
    return pose_matrix(rotation_from_rpy(rpy), np.asarray(position_m, float))


def sideways(n_frames, step_m=0.1, turn_deg=0.0):
    """Poses that move along y in front of the wall x = 5 m."""
    centre = np.arange(n_frames) - (n_frames - 1) / 2
    position_m = np.column_stack([2.2 + 0.02 * centre, 3 + step_m * centre, 1.5 + 0.01 * centre])
    return poses_at(position_m, turn_deg * centre)


def write(folder, poses, room=ROOM, camera=CAMERA):
    """Images of a room from poses."""
    paths = [folder / f"frame-{k:06d}.color.png" for k in range(len(poses))]
    for path, pose in zip(paths, poses, strict=True):
        painted(room, pose, camera=camera).save(path)
    return paths


def estimate(folder, poses, room=ROOM):
    """Reconstruct a room by structure from motion."""
    return sfm_batch(write(folder, poses, room), CAMERA, poses, CFG, 0)


def errors(trajectory, poses):
    """Position (m) and orientation (degrees) errors of all frames, gaps filled."""
    position_m, orientation_rad = pose_error(fill_gaps(trajectory), relative(poses[0], poses))
    return position_m, np.degrees(orientation_rad)


ALIKE = [random_texture(np.random.default_rng(1))] * 6  # walls, not neighbours
STEPS = np.arange(8)[:, None]
FOUND = {
    "a room rich in texture": (sideways(7, turn_deg=2.0), ROOM, 0.01, 0.2),
    "three frames": (
        poses_at([2.6, 3.4, 1.5] + STEPS[:3] * [-0.15, 0.2, 0.0125], 45.0),
        ROOM,
        0.03,
        0.5,
    ),
    "walls that look alike": (
        poses_at([2.2, 2.6, 1.5] + STEPS * [0.0, 0.1, 0.01], 5.0 * STEPS[:, 0]),
        ALIKE,
        0.03,
        0.5,
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_every_frame_is_found_in(name, tmp_path):
    poses, room, most_m, most_deg = FOUND[name]
    trajectory, facts = estimate(tmp_path, poses, room)
    position_m, orientation_deg = errors(trajectory, poses)
    assert trajectory.registered.all()
    assert (facts["models"], facts["starts"]) == (1, 1)
    assert position_m.max() < most_m
    assert orientation_deg.max() < most_deg


def test_mapping_ends_when_its_time_is_over(tmp_path, monkeypatch, caplog):
    clock = itertools.count(0, 3600)
    monkeypatch.setattr(mapping.time, "monotonic", lambda: float(next(clock)))
    trajectory, _ = estimate(tmp_path, sideways(3))
    assert not trajectory.registered.any()
    assert "mapping stopped after max_mapping_s" in caplog.text


@pytest.mark.parametrize("grey", [0, 255])
def test_frames_without_texture_are_lost(tmp_path, grey):
    poses = sideways(40)
    Image.new("RGB", (CAMERA.width, CAMERA.height), (grey,) * 3).save(tmp_path / "wall.png")
    trajectory, facts = sfm_batch([tmp_path / "wall.png"] * 40, CAMERA, poses, CFG, 0)
    assert not trajectory.registered.any()
    assert (facts["models"], facts["starts"], facts["points"]) == (0, 0, 0)


def test_a_white_wall_in_between_loses_its_frames_and_the_smaller_part(tmp_path):
    poses = sideways(13)
    paths = write(tmp_path, poses)
    for path in paths[7:10]:
        Image.new("RGB", (CAMERA.width, CAMERA.height), (255,) * 3).save(path)
    linear = CFG.model_copy(update={"quadratic_overlap": False})
    trajectory, _ = sfm_batch(paths, CAMERA, poses, linear, 0)
    np.testing.assert_array_equal(np.flatnonzero(trajectory.registered), np.arange(7))
    assert errors(trajectory, poses)[0][:7].max() < 0.02


def test_no_motion_has_no_scale_and_is_lost(tmp_path):
    poses = np.repeat(sideways(1), 3, axis=0)
    assert not estimate(tmp_path, poses)[0].registered.any()


def test_a_turn_of_90_degrees_in_5_frames_loses_one_side_and_the_other_is_right(tmp_path):
    turn_deg = np.concatenate([np.zeros(3), np.linspace(0, 90, 6), np.full(3, 90.0)])
    poses = poses_at([1.2, 2.0, 1.5] + np.arange(12)[:, None] * [0.08, 0.05, 0.0], turn_deg)
    trajectory, _ = estimate(tmp_path, poses)
    found = np.flatnonzero(trajectory.registered)
    assert len(found) >= 5
    np.testing.assert_array_equal(found, np.arange(found[0], found[-1] + 1))
    true = relative(poses[0], poses)[found]
    position_m, _ = pose_error(trajectory.first_from_cam[found], true)
    assert position_m.max() < 0.05


def test_a_pattern_that_repeats_within_a_view_misleads_and_the_mapper_starts_again(tmp_path):
    tile = random_texture(np.random.default_rng(1))[:100, :100]
    room = [np.tile(tile, (7, 7))] * 6
    poses = sideways(7, turn_deg=2.0)
    trajectory, facts = estimate(tmp_path, poses, room)
    assert np.isfinite(trajectory.first_from_cam).all()
    assert facts["explained"] < CFG.min_explained
    assert facts["starts"] == 4


def test_a_missing_image_and_one_of_another_size_are_named(tmp_path):
    poses = sideways(3)
    missing = tmp_path / "frame-000000.color.png"
    with pytest.raises(InputError, match=r"frame-000000\.color\.png: missing; collect"):
        sfm_batch([missing], CAMERA, poses[:1], CFG, 0)
    paths = write(tmp_path, poses)
    told = CAMERA.model_copy(update={"width": 320, "height": 240})
    line = r"000000\.color\.png: is of 160 x 120 pixels, the camera of 320 x 240"
    with pytest.raises(InputError, match=line):
        sfm_batch(paths, told, poses, CFG, 0)


def test_labels_are_the_same_bytes_whatever_threads_are_allowed(tmp_path):
    poses = sideways(5, turn_deg=2.0)
    np.save(tmp_path / "poses.npy", poses)
    write(tmp_path, poses)
    found = []
    for threads in ("1", "4"):
        environment = os.environ | {"OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads}
        command = [sys.executable, "-c", LABELS, str(tmp_path), CFG.model_dump_json()]
        subprocess.run(command, env=environment, check=True)
        found.append([path.read_bytes() for path in sorted(tmp_path.glob("*.csv"))])
    assert found[0] == found[1]
    assert len(found[0]) == 2
    assert all(b",1," in labels for labels in found[0])


LABELS = """
import sys
from pathlib import Path
import numpy as np
from baselines.labels.sfm import sfm_batch
from baselines.labels.batches import write_trajectory
from synfeal.config.dataset import CameraConfig
from baselines.config.labels import SfmConfig
folder, cfg = Path(sys.argv[1]), SfmConfig.model_validate_json(sys.argv[2])
camera = CameraConfig(width=160, height=120, horizontal_fov_deg=70.0)
paths, poses = sorted(folder.glob("*.png")), np.load(folder / "poses.npy")
for mapper in ("incremental", "global"):
    told = cfg.model_copy(update={"mapper": mapper})
    trajectory, _ = sfm_batch(paths, camera, poses, told, 7)
    write_trajectory(folder / f"{mapper}.csv", trajectory)
"""


def test_scale_bears_wrong_poses_and_leaves_out_near_and_late_frames():
    true = np.column_stack([0.04 * np.arange(60), np.zeros(60), np.zeros(60)])
    model = true / 3
    model[1] = [9, 9, 9]  # 4 cm from the first frame
    model[44:] *= 5  # beyond the first 44 frames
    model[10:15] *= 7  # wrong, but a minority
    assert metric_scale(true, model) == pytest.approx(3.0)
    assert np.isnan(metric_scale(np.zeros((5, 3)), np.ones((5, 3))))  # no motion, no scale
    assert np.isnan(metric_scale(np.eye(3), np.zeros((3, 3))))
