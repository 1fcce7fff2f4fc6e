"""Bounds of a collection from a trajectory, in closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from synfeal.cli import main
from synfeal.config.collect import LikeConfig, checked
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.world import MESH_SHA256, SCAN, read_scan_record
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.save import save_glb
from synfeal.planning.like import like_trajectory, resized, rpy_of
from synfeal.planning.space import seen_shares
from synfeal.records.files import file_sha256, write_json
from tests.support.collected import painted

Array = NDArray[np.float64]


def write_poses(folder: Path, world_from_cam: Array) -> None:
    """Frames of which only the poses matter."""
    folder.mkdir()
    for number, pose in enumerate(world_from_cam):
        np.savetxt(folder / f"frame-{number:06d}.pose.txt", pose)
        (folder / f"frame-{number:06d}.color.png").write_bytes(b"")


def poses_at(rpy_deg: Array, position_m: Array) -> Array:
    return pose_matrix(rotation_from_rpy(np.deg2rad(rpy_deg)), position_m)


def test_angles_come_back() -> None:
    rng = np.random.default_rng(0)
    rpy = rng.uniform([-3.0, -1.5, -3.0], [3.0, 1.5, 3.0], (50, 3))
    np.testing.assert_allclose(rpy_of(rotation_from_rpy(rpy)), rpy, atol=1e-12)


def test_box_and_angles_with_margins(tmp_path: Path) -> None:
    rpy = np.array([[-5.0, 10.0, 350.0], [15.0, 30.0, 20.0], [0.0, 20.0, 5.0]])
    position = np.array([[1.0, 2.0, 3.0], [-1.0, 5.0, 3.5], [0.0, 3.0, 3.2]])
    write_poses(tmp_path / "seq", poses_at(rpy, position))
    found = like_trajectory(
        mesh=tmp_path / "mesh.glb",
        sequence=tmp_path / "seq",
        frames=None,
        margin_m=0.5,
        margin_deg=10.0,
    )
    np.testing.assert_allclose(found.box, [-1.5, 1.5, 1.5, 5.5, 2.5, 4.0])
    np.testing.assert_allclose(found.roll_deg, [-15.0, 25.0])
    np.testing.assert_allclose(found.pitch_deg, [0.0, 40.0], atol=1e-12)
    np.testing.assert_allclose(found.yaw_deg, [-20.0, 30.0])  # through north, not the long way
    assert found.camera is None


def test_all_headings_are_a_whole_turn_and_steep_views_stay_below_the_pole(tmp_path: Path) -> None:
    yaw = np.arange(0.0, 360.0, 20.0)
    rpy = np.stack([0.0 * yaw, np.full_like(yaw, 85.0), yaw], axis=1)
    write_poses(tmp_path / "seq", poses_at(rpy, np.zeros((len(yaw), 3))))
    found = like_trajectory(tmp_path / "mesh.glb", tmp_path / "seq", None, 0.1, 10.0)
    assert found.yaw_deg == (0.0, 360.0)
    assert found.pitch_deg[1] < 90.0


def test_a_scan_says_where_its_world_is_and_what_its_camera_is(tmp_path: Path) -> None:
    upright = poses_at(np.array([[0.0, 5.0, 90.0], [2.0, 7.0, 100.0]]), np.eye(3)[:2])
    sequence_from_world = poses_at(np.array([40.0, -30.0, 70.0]), np.array([3.0, 2.0, 1.0]))
    write_poses(tmp_path / "seq", inverse(sequence_from_world @ upright))
    color = {"width": 640, "height": 480, "fx": 520.0, "fy": 521.0, "cx": 318.0, "cy": 241.0}
    record = {
        "sequence_from_world": sequence_from_world.tolist(),
        "poses_are": "cam_from_world",
        "camera": {"color": color},
    }
    (tmp_path / "scan.json").write_text(json.dumps(record))
    found = like_trajectory(tmp_path / "scan.glb", tmp_path / "seq", None, 0.0, 0.0)
    np.testing.assert_allclose(found.box, [0.0, 1.0, 0.0, 1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.yaw_deg, [90.0, 100.0])
    np.testing.assert_allclose(found.pitch_deg, [5.0, 7.0], atol=1e-9)
    assert found.camera is not None
    small = resized(found.camera, 320, None)
    assert (small.width, small.height) == (320, 240)
    np.testing.assert_allclose(small.intrinsics, [260.0, 260.5, 159.0, 120.5])


def test_records_of_others_are_passed_over(tmp_path: Path) -> None:
    assert read_scan_record(tmp_path / "scan.glb") is None
    for text in ("[1, 2]", "{", '{"other": 1}'):
        (tmp_path / "scan.json").write_text(text)
        assert read_scan_record(tmp_path / "scan.glb") is None
    (tmp_path / "scan.json").write_text('{"sequence_from_world": [[1, 0], [0, 1]]}')
    with pytest.raises(InputError, match=r"scan\.json: sequence_from_world"):
        read_scan_record(tmp_path / "scan.glb")


@pytest.mark.parametrize("name", ["kitchen.glb", "elsewhere/kitchen.glb", "linked.glb"])
def test_a_scan_keeps_its_world_under_another_name(tmp_path: Path, name: str) -> None:
    sequence_from_world = poses_at(np.array([40.0, -30.0, 70.0]), np.array([3.0, 2.0, 1.0]))
    record = {"sequence_from_world": sequence_from_world.tolist()}
    scan, other = tmp_path / "scan.glb", tmp_path / name
    save_glb(scan, painted(trimesh.creation.box()), {SCAN: record})
    # A record of another scan that had the new name before says nothing of this one.
    other.parent.mkdir(exist_ok=True)
    other.with_suffix(".json").write_text('{"sequence_from_world": [[1, 0], [0, 1]]}')
    other.symlink_to(scan) if name == "linked.glb" else scan.rename(other)
    found = read_scan_record(other)
    assert found is not None
    np.testing.assert_array_equal(found.sequence_from_world, sequence_from_world)


def test_a_record_beside_another_mesh_is_used_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    record = {"sequence_from_world": np.eye(4).tolist()}
    scan, linked = tmp_path / "scan.glb", tmp_path / "linked.glb"
    save_glb(scan, painted(trimesh.creation.box()))
    linked.symlink_to(scan)
    write_json(tmp_path / "scan.json", {**record, MESH_SHA256: file_sha256(scan)})
    assert read_scan_record(scan) is not None
    assert read_scan_record(linked) is not None
    assert not caplog.records
    save_glb(scan, painted(trimesh.creation.box((2.0, 1.0, 1.0))))
    assert read_scan_record(scan) is not None
    assert "is not the mesh that scan.json was written with" in caplog.text


def test_sides_that_do_not_fit_and_negative_margins(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="aspect ratio"):
        resized(CameraConfig(width=640, height=480), 320, 200)
    with pytest.raises(InputError, match=r"^margin_m: must be 0 or more"):
        checked(LikeConfig, {"like": tmp_path, "margin_m": -0.1})


def test_seen_share_of_half_a_wall() -> None:
    # A wall at x = 2 that begins straight ahead and goes on to the left.
    corners = np.array([[2.0, 0, -9], [2, 9, -9], [2, 9, 9], [2, 0, 9]])
    caster = RayCaster(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    ahead = np.zeros(6)
    left, right = ahead.copy(), ahead.copy()
    left[5], right[5] = np.deg2rad(30.0), np.deg2rad(-30.0)
    np.testing.assert_allclose(seen_shares(caster, np.stack([ahead, left, right])), [0.5, 1.0, 0.0])


def test_margins_go_with_like(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["collect", "a.glb", "--frames", "5", "--out", str(tmp_path / "out")]
    assert main([*asked, "--margin", "0.1"]) == 1
    assert capsys.readouterr().err == "error: --margin: goes with a sequence to be like\n"
