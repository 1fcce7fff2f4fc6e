"""``synfeal scan`` gives back a room seen in photographs, and says what is wrong with them."""

from __future__ import annotations

import json
import os
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial.transform import Rotation

from synfeal.cli import main
from synfeal.dataset.world import read_sequence_from_world
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.load import load_mesh
from synfeal.scanning.camera import CameraOptions
from synfeal.scanning.cleaning import without_small_pieces
from synfeal.scanning.fusion import FusedSurface, ordered
from synfeal.scanning.gravity import GravityError, find_gravity, likely_up
from synfeal.scanning.run import ScanJob, scan
from tests.support.scan_sequence import (
    COLOR_PX,
    DEPTH_PX,
    SEQUENCE_FROM_ROOM,
    room_from_cam,
    write_sequence,
)
from tests.support.small_room import furnished_room

o3d = pytest.importorskip("open3d")
VOXEL_M = 0.02
OPTIONS = ("--depth-focal", str(DEPTH_PX), "--voxel", str(VOXEL_M), "--max-depth", "6")


def run_scan(sequence: Path, out: Path, *options: str) -> int:
    """The exit status of the command."""
    focal = () if "--color-focal" in options else ("--color-focal", str(COLOR_PX))
    return main(["scan", str(sequence), "--out", str(out), *OPTIONS, *focal, *options])


@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sequence") / "seq"
    write_sequence(folder)
    return folder


@pytest.fixture(scope="module")
def scanned(sequence: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("scan") / "room.glb"
    assert run_scan(sequence, out) == 0
    return out


@pytest.fixture
def copied(sequence: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(sequence, tmp_path / "seq"))


def record_of(scan: Path) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(scan.with_suffix(".json").read_text())
    return record


def test_surface_lies_within_a_voxel_of_the_room(scanned: Path) -> None:
    mesh = load_mesh(scanned)
    sequence_from_world = np.array(record_of(scanned)["sequence_from_world"])
    room_from_world = inverse(SEQUENCE_FROM_ROOM) @ sequence_from_world
    vertices = mesh.merged()[0] @ room_from_world[:3, :3].T + room_from_world[:3, 3]
    true_vertices, true_faces = furnished_room((4.0, 12.0, 40.0)).merged()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(true_vertices.astype(np.float32), true_faces.astype(np.uint32))
    distance_m = scene.compute_distance(vertices.astype(np.float32)).numpy()
    assert np.median(distance_m) < 0.25 * VOXEL_M
    assert np.quantile(distance_m, 0.97) < VOXEL_M


def test_room_stands_upright(scanned: Path) -> None:
    found = np.array(record_of(scanned)["sequence_from_world"])[:3, 2]
    true = SEQUENCE_FROM_ROOM[:3, 2]
    assert np.rad2deg(np.arccos(found @ true)) < 1.0
    # Along the walls, and on the floor.
    lower, upper = load_mesh(scanned).bounds_m
    np.testing.assert_allclose(sorted((upper - lower)[:2]), [4.0, 5.0], atol=4 * VOXEL_M)
    assert abs(lower[2]) < 2 * VOXEL_M


def test_renderings_are_like_photographs(scanned: Path) -> None:
    seen = record_of(scanned)["photographs"]
    # Paint with a standard deviation of 45 grey levels, some of it finer than a voxel.
    assert seen["held_out"]
    assert seen["difference"] < 10.0
    assert seen["covered"] > 0.8  # what two of the fused frames see
    with Image.open(scanned.with_suffix(".png")) as picture:
        assert picture.size[0] == 4 * 160


def test_right_calibration_is_left_as_it_is(scanned: Path) -> None:
    color = record_of(scanned)["camera"]["color"]
    assert color["fx"] == pytest.approx(COLOR_PX, rel=0.005)
    assert color["cx"] == pytest.approx(160.0, abs=1.0)
    assert color["cy"] == pytest.approx(120.0, abs=1.0)
    assert record_of(scanned)["depth_best_focal_px"] == pytest.approx(DEPTH_PX, rel=0.01)
    assert record_of(scanned)["depth_agreement"] > 0.95


def test_focal_length_of_depth_for_colour_is_told_and_mended(
    sequence: Path, scanned: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    wrong = ("--color-focal", str(DEPTH_PX))
    assert run_scan(sequence, tmp_path / "mended.glb", *wrong) == 0
    assert f"{DEPTH_PX:.0f} px was given for colour" in caplog.text
    mended = record_of(tmp_path / "mended.glb")
    assert mended["camera"]["color"]["fx"] == pytest.approx(COLOR_PX, rel=0.01)
    caplog.clear()
    assert run_scan(sequence, tmp_path / "kept.glb", *wrong, "--keep-calibration") == 0
    assert f"give `color_focal_px={COLOR_PX:.0f}`" in caplog.text
    kept, right = record_of(tmp_path / "kept.glb"), record_of(scanned)
    assert kept["camera"]["color"]["fx"] == DEPTH_PX
    disagreement = [r["color_disagreement"]["given"] for r in (kept, right)]
    assert disagreement[0] > 2.0 * disagreement[1]
    assert kept["photographs"]["difference"] > 1.2 * right["photographs"]["difference"]


def refused(sequence: Path, out: Path, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    """The one line in which a scan is refused; nothing is written."""
    assert run_scan(sequence, out, *options) == 1
    assert not list(out.parent.glob(f"{out.stem}*"))
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1
    return lines[0]


def test_depth_in_another_unit(
    copied: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in copied.glob("*.depth.png"):
        with Image.open(path) as image:
            depth = np.asarray(image)
        Image.fromarray((depth * np.uint16(5)).astype(np.uint16)).save(path)
    line = refused(copied, tmp_path / "out.glb", capsys)
    assert "give --depth-scale 5000" in line


def test_poses_in_the_other_direction(
    copied: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in copied.glob("*.pose.txt"):
        np.savetxt(path, inverse(np.loadtxt(path)))
    line = refused(copied, tmp_path / "out.glb", capsys)
    assert "give --convention cam_from_world" in line
    few = ("--convention", "cam_from_world", "--range", "0", "16", "--keep-axes")
    assert run_scan(copied, tmp_path / "right.glb", *few) == 0


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        ("no depth image", "frame-000004.depth.png: missing"),
        ("no depth", "has no depth images"),
        ("poses of others", "depth and poses do not fit together"),
        ("other size", "all images of a camera must be of its size"),
    ],
)
def test_sequences_that_cannot_be_scanned(
    damage: str, said: str, copied: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if damage == "no depth image":
        (copied / "frame-000004.depth.png").unlink()
    if damage == "no depth":
        for path in copied.glob("*.depth.png"):
            path.unlink()
    if damage == "poses of others":
        paths = sorted(copied.glob("*.pose.txt"))
        texts = [path.read_text() for path in paths]
        order = np.random.default_rng(0).permutation(len(paths))
        for path, index in zip(paths, order, strict=True):
            path.write_text(texts[index])
    if damage == "other size":
        Image.fromarray(np.ones((20, 20), np.uint16)).save(copied / "frame-000002.depth.png")
    assert said in refused(copied, tmp_path / "out.glb", capsys)


def test_options_that_contradict_or_lack(
    sequence: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scan", str(sequence), "--out", str(tmp_path / "x.glb")]) == 1
    assert "give --preset" in capsys.readouterr().err
    assert (
        main(["scan", str(sequence), "--out", str(tmp_path / "x.glb"), "--preset", "7scenes"]) == 1
    )
    assert "640x480" in capsys.readouterr().err
    assert "a scan is binary glTF" in refused(sequence, tmp_path / "x.obj", capsys)
    assert "holds no frame" in refused(sequence, tmp_path / "x.glb", capsys, "--range", "9", "9")
    assert "--keep-axes" in refused(
        sequence, tmp_path / "x.glb", capsys, "--keep-axes", "--gravity", "0", "0", "-1"
    )


def test_open3d_is_asked_for(
    sequence: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)  # as if it were not installed
    assert "pip install 'synfeal[scan]'" in refused(sequence, tmp_path / "x.glb", capsys)


def test_given_gravity_and_kept_axes(sequence: Path, tmp_path: Path) -> None:
    few = ("--range", "0", "12")
    down = [f"{value:.6f}" for value in -SEQUENCE_FROM_ROOM[:3, 2]]
    assert run_scan(sequence, tmp_path / "given.glb", *few, "--gravity", *down) == 0
    given = np.array(record_of(tmp_path / "given.glb")["sequence_from_world"])
    np.testing.assert_allclose(given[:3, 2], SEQUENCE_FROM_ROOM[:3, 2], atol=1e-5)
    assert run_scan(sequence, tmp_path / "kept.glb", *few, "--keep-axes") == 0
    kept = np.array(record_of(tmp_path / "kept.glb")["sequence_from_world"])
    np.testing.assert_array_equal(kept, np.eye(4))


def surface_of(vertices: Any, faces: Any) -> FusedSurface:
    vertices = np.asarray(vertices, np.float64)
    return FusedSurface(vertices, np.zeros_like(vertices), np.asarray(faces, np.int64))


def test_the_order_that_threads_find_a_surface_in_does_not_matter() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    rng = np.random.default_rng(0)
    expected = ordered(vertices, faces)
    assert trimesh.Trimesh(*expected, process=False).volume == pytest.approx(ball.volume)
    for _ in range(3):
        order, turns = rng.permutation(len(vertices)), rng.integers(0, 3, len(faces))
        renamed = np.argsort(order)[faces][rng.permutation(len(faces))]
        renamed = np.array([np.roll(face, turn) for face, turn in zip(renamed, turns, strict=True)])
        for found, wanted in zip(ordered(vertices[order], renamed), expected, strict=True):
            np.testing.assert_array_equal(found, wanted)


def test_a_ball_has_no_gravity() -> None:
    ball = o3d.geometry.TriangleMesh.create_sphere(1.0, 40)
    surface = surface_of(ball.vertices, ball.triangles)
    with pytest.raises(InputError, match=r"no gravity found.*`gravity="):
        find_gravity(surface, room_from_cam())


def plate(x: Any, y: Any) -> tuple[Any, Any]:
    """A square spanned by two vectors."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    return np.stack([0 * x, x, x + y, y]), np.array([[0, 1, 2], [0, 2, 3]])


def test_one_wall_holds_no_gravity_but_two_walls_or_a_floor_do() -> None:
    leaning = Rotation.from_rotvec([0.3, -0.2, 0.4]).as_matrix()
    x, y, up = leaning.T
    # Two photographs, held within 20 degrees of upright, looking along x.
    cameras = np.stack([pose_matrix(leaning @ rotation_from_rpy([0.2, 0.3, 0]), np.zeros(3))] * 2)
    wall, other, floor = plate(y, up), plate(x, up), plate(x, y)
    with pytest.raises(InputError, match="no gravity found"):
        find_gravity(surface_of(*wall), cameras)
    for second in (other, floor):
        vertices = np.concatenate([wall[0], second[0]])
        found = find_gravity(
            surface_of(vertices, np.concatenate([wall[1], second[1] + 4])), cameras
        )
        np.testing.assert_allclose(found.up, up, atol=1e-6)


def test_cameras_turned_all_ways_have_no_upper_edge() -> None:
    box = o3d.geometry.TriangleMesh.create_box()
    turned = [pose_matrix(np.diag([-1.0, -1.0, 1.0]), np.zeros(3)), np.eye(4)]
    with pytest.raises(InputError, match="turned all ways"):
        find_gravity(surface_of(box.vertices, box.triangles), np.stack(turned))


def test_an_axis_of_the_world_stands_in_for_the_way_up() -> None:
    up = Rotation.from_rotvec([0.3, 0.1, 0.0]).as_matrix()  # held 18 degrees off
    y_is_down = np.stack([pose_matrix(up, np.zeros(3))] * 3)
    np.testing.assert_array_equal(likely_up(y_is_down), [0.0, -1.0, 0.0])
    np.testing.assert_array_equal(likely_up(room_from_cam()), [0.0, 0.0, 1.0])
    turned = [pose_matrix(np.diag([-1.0, -1.0, 1.0]), np.zeros(3)), np.eye(4)]
    np.testing.assert_array_equal(likely_up(np.stack(turned)), [0.0, 0.0, 1.0])


def test_a_scan_that_needs_no_gravity_warns_where_it_finds_none(
    sequence: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def none_found(*_: object) -> None:
        raise GravityError("scan: no gravity found: 1 % is level; give it")

    monkeypatch.setattr("synfeal.scanning.run.find_gravity", none_found)
    job = ScanJob(
        sequence=sequence,
        out=tmp_path / "room.glb",
        cameras=CameraOptions(color_focal_px=COLOR_PX, depth_focal_px=DEPTH_PX),
        stop=12,
        voxel_m=VOXEL_M,
    )
    with pytest.raises(GravityError):
        scan(job)
    found = scan(replace(job, needs_gravity=False)).record
    up = np.array(found["sequence_from_world"])[:3, 2]
    assert sorted(np.abs(up)) == pytest.approx([0.0, 0.0, 1.0])
    assert up @ SEQUENCE_FROM_ROOM[:3, 2] > 0.5  # of the six axes the one that leads up
    assert found["gravity"].startswith("not found: ")
    assert "scan: no gravity found: 1 % is level: " in caplog.text


def test_small_pieces_are_dropped() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    vertices = np.concatenate([square, 0.1 * square + 5.0, 0.5 * square - 5.0])
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * piece for piece in range(3)])
    rest, n_dropped = without_small_pieces(surface_of(vertices, faces), 0.2)
    assert n_dropped == 1
    np.testing.assert_array_equal(rest.vertices_m[rest.faces], vertices[faces[[0, 1, 4, 5]]])
    assert without_small_pieces(surface_of(vertices, faces), 10.0)[1] == 2  # the largest stays


def test_frames_like_the_photographs(sequence: Path, scanned: Path, tmp_path: Path) -> None:
    out, renamed = tmp_path / "frames", tmp_path / "kitchen.glb"
    shutil.copy(scanned, renamed)  # which takes its world and its camera with it
    like = ("--like", str(sequence), "--frames", "12", "--width", "160", "--margin", "0.1")
    assert main(["collect", str(renamed), "--out", str(out), *like]) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    color = record_of(scanned)["camera"]["color"]
    assert (manifest["camera"]["width"], manifest["camera"]["height"]) == (160, 120)
    for name in ("fx", "fy", "cx", "cy"):
        assert manifest["camera"][name] == pytest.approx(color[name] / 2.0)
    sequence_from_world = read_sequence_from_world(out)
    assert sequence_from_world is not None
    np.testing.assert_array_equal(
        sequence_from_world, np.array(record_of(scanned)["sequence_from_world"])
    )
    # In the room itself the frames lie in the box of the photographs' centres and the margin; that
    # box is turned with the walls, so the room's own axes are its axes, in one order or the other.
    poses = np.array([np.loadtxt(path) for path in sorted(out.glob("seq-01/*.pose.txt"))])
    room_from_frames = inverse(SEQUENCE_FROM_ROOM) @ sequence_from_world @ poses
    true = room_from_cam()[:, :3, 3]
    assert (room_from_frames[:, :3, 3] > true.min(axis=0) - 0.15).all()
    assert (room_from_frames[:, :3, 3] < true.max(axis=0) + 0.15).all()


def test_a_mesh_without_colour_is_told(
    scanned: Path, sequence: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    grey = o3d.geometry.TriangleMesh.create_box()
    o3d.io.write_triangle_mesh(str(tmp_path / "grey.ply"), grey)
    asked = ["collect", str(tmp_path / "grey.ply"), "--frames", "5"]
    assert main([*asked, "--out", str(tmp_path / "out")]) == 1
    assert "colour" in capsys.readouterr().err


SEQUENCE = os.environ.get("SYNFEAL_TEST_SEQUENCE")


@pytest.mark.skipif(SEQUENCE is None, reason="SYNFEAL_TEST_SEQUENCE names no RedKitchen folder")
def test_real_sequence(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert SEQUENCE is not None
    out, wrong = tmp_path / "scan.glb", tmp_path / "wrong.glb"
    asked = ["scan", SEQUENCE, "--range", "0", "200", "--stride", "4", "--voxel", "0.02"]
    assert main([*asked, "--preset", "7scenes", "--out", str(out)]) == 0
    assert "focal length" not in caplog.text
    # What its folder says of both cameras is true of the depth camera.
    files = ["--color-focal", "585", "--depth-focal", "585", "--keep-calibration"]
    assert main([*asked, *files, "--out", str(wrong)]) == 0
    assert "585 px was given for colour: give `color_focal_px=52" in caplog.text
    right_record, wrong_record = record_of(out), record_of(wrong)
    # Other code, another scan of this room: up is 26.6 degrees from the first frame's upper edge.
    up = np.array(right_record["sequence_from_world"])[:3, 2]
    assert np.rad2deg(np.arccos(-up[1])) == pytest.approx(26.6, abs=1.0)
    assert right_record["camera"]["color"]["fx"] == pytest.approx(525.0, rel=0.02)
    assert right_record["depth_best_focal_px"] == pytest.approx(585.0, rel=0.02)
    assert (
        wrong_record["photographs"]["difference"] > right_record["photographs"]["difference"] + 2.0
    )
