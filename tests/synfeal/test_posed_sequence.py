"""Posed sequences: files are paired by name, poses come back, gaps are told."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.dataset.world import read_sequence_from_world, write_sequence_from_world
from synfeal.errors import InputError

pytestmark = pytest.mark.portable


def pose_of(number: int) -> NDArray[np.float64]:
    """A rigid pose that tells which frame it belongs to: x is the number."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.1 * number, -0.2, 0.3]).as_matrix()
    pose[:3, 3] = number, 0.5, -2.0
    return pose


def write_frame(folder: Path, number: int, color: str = "png", depth: bool = True) -> None:
    """A frame as 7-Scenes stores it, with images of two pixels."""
    folder.mkdir(parents=True, exist_ok=True)
    stem = folder / f"frame-{number:06d}"
    Image.fromarray(np.zeros((1, 2, 3), np.uint8)).save(f"{stem}.color.{color}")
    if depth:
        Image.fromarray(np.ones((1, 2), np.uint16)).save(f"{stem}.depth.png")
    np.savetxt(f"{stem}.pose.txt", pose_of(number))


@pytest.mark.parametrize("color", ["png", "jpg"])
def test_flat_folder(tmp_path: Path, color: str) -> None:
    for number in (0, 3, 10):
        write_frame(tmp_path, number, color)
    found = read_posed_sequence(tmp_path)
    assert found.names == ("frame-000000", "frame-000003", "frame-000010")
    assert [str(path) for path in found.color] == [
        str(tmp_path / f"frame-0000{n}.color.{color}") for n in ("00", "03", "10")
    ]
    assert [str(path) for path in found.depth] == [
        str(tmp_path / f"frame-0000{n}.depth.png") for n in ("00", "03", "10")
    ]
    np.testing.assert_allclose(found.world_from_cam, [pose_of(n) for n in (0, 3, 10)], atol=1e-15)


def test_sequences_follow_each_other_by_number(tmp_path: Path) -> None:
    for sequence in (2, 10, 1):
        write_frame(tmp_path / f"seq-{sequence:02d}", sequence)
    found = read_posed_sequence(tmp_path)
    assert found.names == (
        "seq-01/frame-000001",
        "seq-02/frame-000002",
        "seq-10/frame-000010",
    )
    np.testing.assert_allclose(found.world_from_cam[:, 0, 3], [1.0, 2.0, 10.0])


def test_archived_sequence_is_read_like_a_folder(tmp_path: Path) -> None:
    write_frame(tmp_path / "loose", 7)
    (tmp_path / "set").mkdir()
    with zipfile.ZipFile(tmp_path / "set" / "seq-03.zip", "w") as archive:
        for path in (tmp_path / "loose").iterdir():
            archive.write(path, f"seq-03/{path.name}")
    for place in (tmp_path / "set", tmp_path / "set" / "seq-03.zip"):
        found = read_posed_sequence(place)
        assert found.names[0].endswith("frame-000007")
        assert (
            found.color[0].read_bytes()
            == (tmp_path / "loose" / "frame-000007.color.png").read_bytes()
        )


def test_ranges_count_frames_over_all_sequences(tmp_path: Path) -> None:
    for number in range(4):
        write_frame(tmp_path / "seq-01", number)
        write_frame(tmp_path / "seq-02", number + 4)
    found = read_posed_sequence(tmp_path, slice(1, 7, 2))
    np.testing.assert_allclose(found.world_from_cam[:, 0, 3], [1.0, 3.0, 5.0])
    with pytest.raises(InputError, match="has 8 frames, none"):
        read_posed_sequence(tmp_path, slice(8, 20))


def test_sequence_without_depth(tmp_path: Path) -> None:
    for number in range(2):
        write_frame(tmp_path, number, depth=False)
    found = read_posed_sequence(tmp_path)
    assert found.depth == (None, None)
    assert not found.has_depth


@pytest.mark.parametrize("kind", ["color.png", "depth.png", "pose.txt"])
def test_missing_file_is_named(tmp_path: Path, kind: str) -> None:
    for number in range(3):
        write_frame(tmp_path, number)
    (tmp_path / f"frame-000001.{kind}").unlink()
    with pytest.raises(InputError, match=rf"frame-000001\.{kind}.*: missing"):
        read_posed_sequence(tmp_path)
    assert len(read_posed_sequence(tmp_path, slice(2, 3))) == 1


def test_second_colour_image_is_refused(tmp_path: Path) -> None:
    write_frame(tmp_path, 0, "png")
    write_frame(tmp_path, 0, "jpg")
    with pytest.raises(InputError, match="second colour image"):
        read_posed_sequence(tmp_path)


def test_lost_frames_are_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for number in range(3):
        write_frame(tmp_path, number)
    np.savetxt(tmp_path / "frame-000001.pose.txt", np.full((4, 4), np.nan))
    assert read_posed_sequence(tmp_path).names == ("frame-000000", "frame-000002")
    assert "frame-000001.pose.txt: is not finite" in caplog.text


@pytest.mark.parametrize("damage", ["mirrored", "scaled", "short", "text"])
def test_what_is_no_pose_is_named(tmp_path: Path, damage: str) -> None:
    write_frame(tmp_path, 0)
    path = tmp_path / "frame-000000.pose.txt"
    pose = pose_of(0)
    if damage == "mirrored":
        pose[:, 0] *= -1.0
    if damage == "scaled":
        pose[:3, :3] *= 1.1
    np.savetxt(path, pose[:3] if damage == "short" else pose)
    if damage == "text":
        path.write_text("no pose at all")
    with pytest.raises(InputError, match=r"frame-000000\.pose\.txt"):
        read_posed_sequence(tmp_path)


def test_folders_that_hold_no_sequence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no frame-000000"):
        read_posed_sequence(tmp_path)
    with pytest.raises(InputError, match="is not a folder"):
        read_posed_sequence(tmp_path / "absent")
    write_frame(tmp_path, 0)
    write_frame(tmp_path / "seq-01", 0)
    with pytest.raises(InputError, match="give one of its sequences"):
        read_posed_sequence(tmp_path)


def write_tum(folder: Path) -> None:
    """Photographs at 1.00, 1.10, 1.20 s; depth 5 ms later; poses every 25 ms, x equal to time."""
    for kind, shift in (("rgb", 0.0), ("depth", 0.005)):
        (folder / kind).mkdir()
        rows = ["# timestamp filename"]
        for stamp in (1.0, 1.1, 1.2):
            name = f"{kind}/{stamp + shift:.4f}.png"
            (folder / name).write_bytes(b"")
            rows.append(f"{stamp + shift:.4f} {name}")
        (folder / f"{kind}.txt").write_text("\n".join(rows))
    rows = ["# timestamp tx ty tz qx qy qz qw"]
    for stamp in np.arange(0.99, 1.16, 0.025):
        turn = Rotation.from_rotvec([0.0, 0.0, stamp]).as_quat()
        rows.append(" ".join(f"{value:.9f}" for value in (stamp, stamp, 2.0, 3.0, *turn)))
    (folder / "groundtruth.txt").write_text("\n".join(rows))


def test_tum_poses_are_interpolated_in_time(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    write_tum(tmp_path)
    found = read_posed_sequence(tmp_path)
    assert found.names == ("1.0000", "1.1000")  # the third is later than the last pose
    assert "1 of 3 photographs" in caplog.text
    assert found.depth[1] == tmp_path / "depth" / "1.1050.png"
    for pose, stamp in zip(found.world_from_cam, (1.0, 1.1), strict=True):
        np.testing.assert_allclose(pose[:3, 3], [stamp, 2.0, 3.0], atol=1e-8)
        turn = Rotation.from_rotvec([0.0, 0.0, stamp]).as_matrix()
        np.testing.assert_allclose(pose[:3, :3], turn, atol=1e-8)


def test_tum_names_what_is_missing(tmp_path: Path) -> None:
    write_tum(tmp_path)
    (tmp_path / "depth" / "1.1050.png").unlink()
    with pytest.raises(InputError, match=r"1\.1050\.png: missing"):
        read_posed_sequence(tmp_path)


def test_world_comes_back(tmp_path: Path) -> None:
    assert read_sequence_from_world(tmp_path) is None
    write_sequence_from_world(tmp_path, pose_of(3))
    found = read_sequence_from_world(tmp_path)
    assert found is not None
    np.testing.assert_array_equal(found, pose_of(3))


@pytest.mark.parametrize("text", ["{}", "[]", '{"sequence_from_world": [[2]]}', "{", "[1e999]"])
def test_world_that_is_none(tmp_path: Path, text: str) -> None:
    (tmp_path / "world.json").write_text(text)
    with pytest.raises(InputError, match=r"world\.json"):
        read_sequence_from_world(tmp_path)
