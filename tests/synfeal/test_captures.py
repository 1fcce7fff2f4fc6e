"""Captures of every format come back as they were written, and refuse what is no capture."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

import synfeal
from synfeal.camera.calibration import read_calibration
from synfeal.captures.capture import Capture
from synfeal.captures.formats import CaptureFormat, capture_formats, format_of, read_capture
from synfeal.captures.unpack import read_capture_record, unpack
from synfeal.cli import main
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse
from synfeal.inspection.captured import capture_facts
from synfeal.scanning.run import ScanJob, scan
from tests import ROOT
from tests.support.capture_writers import (
    CX,
    CY,
    FOCAL_PX,
    HEIGHT,
    LEANING_FROM_ROOM,
    WIDTH,
    WRITERS,
    Y_UP_FROM_ROOM,
    Z_UP_FROM_ROOM,
    shots,
    tum,
)
from tests.support.small_room import furnished_room

FORMATS = sorted(WRITERS)
LOSSLESS = ("7scenes", "transforms", "arkitscenes", "colmap", "colmap-binary")
# Largest difference of a pose from the one it was written from: digits in the text.
WRITTEN_TO = 1e-6


def written(name: str, folder: Path) -> tuple[Path, np.ndarray]:
    if name in ("record3d", "stray-scanner"):
        pytest.importorskip("lzfse" if name == "record3d" else "cv2")
    path = folder / (f"{name}.r3d" if name == "record3d" else name)
    return path, WRITERS[name](path)


@pytest.fixture(scope="module", params=FORMATS)
def captured(request, tmp_path_factory) -> tuple[str, Capture, np.ndarray]:
    path, world_from_room = written(request.param, tmp_path_factory.mktemp("capture"))
    return request.param, read_capture(path), world_from_room


def test_format_is_found_from_the_files_alone(captured):
    name, capture, _ = captured
    assert capture.format == name.removesuffix("-binary")
    assert format_of(capture.path).name == capture.format


def test_poses_come_back(captured):
    _, capture, world_from_room = captured
    expected = world_from_room @ shots().room_from_cam
    assert len(capture) == len(expected)
    np.testing.assert_allclose(capture.world_from_cam, expected, atol=WRITTEN_TO)


def test_up_is_that_of_the_room_where_the_device_knows_it(captured):
    name, capture, world_from_room = captured
    if name in ("record3d", "stray-scanner", "polycam", "3d-scanner-app", "arkitscenes"):
        np.testing.assert_allclose(capture.up, world_from_room[:3, :3] @ [0, 0, 1], atol=1e-12)
    else:
        assert capture.up is None


def test_calibration_is_that_of_the_photographs(captured):
    _, capture, _ = captured
    one = capture.frames[0].camera
    assert (one.width, one.height) == (WIDTH, HEIGHT)
    np.testing.assert_allclose([one.fx, one.fy, one.cx, one.cy], [FOCAL_PX, FOCAL_PX, CX, CY])


def test_pictures_and_depth_are_those_of_their_poses(captured):
    name, capture, _ = captured
    for number in (0, 17, len(capture) - 1):
        frame = capture.frames[number]
        off = np.abs(frame.read_color().astype(float) - shots().rgb[number])
        assert (
            off.max() == 0
            if name in LOSSLESS
            else off.mean() < (25.0 if name == "stray-scanner" else 6.0)
        )
        depth_m = frame.read_depth_m()
        full = depth_m.shape == shots().depth_m[number].shape
        expected = (shots().depth_m if full else shots().small_depth_m)[number]
        np.testing.assert_allclose(depth_m, expected, atol=6e-4)
        assert depth_m.shape == (frame.depth_camera.height, frame.depth_camera.width)
        # The same view in other pixels: the optical axis meets the same share of the image.
        assert frame.depth_camera.cx / depth_m.shape[1] == pytest.approx(
            frame.camera.cx / WIDTH, abs=2e-3
        )


def test_unpacked_it_is_a_posed_sequence(captured, tmp_path):
    _, capture, world_from_room = captured
    done = unpack(capture, tmp_path / "sequence")
    frames = read_posed_sequence(done.folder)
    np.testing.assert_allclose(
        frames.world_from_cam, world_from_room @ shots().room_from_cam, atol=WRITTEN_TO
    )
    assert frames.has_depth
    record = read_capture_record(done.folder)
    assert record["names"] == [frame.name for frame in capture.frames]
    assert record["camera"]["color"]["fx"] == pytest.approx(FOCAL_PX)
    assert read_calibration(done.folder / "capture.json") == done.color
    again = read_capture(done.folder)  # as `inspect` and `build` read it
    assert again.frames[0].camera == done.color
    assert again.up == capture.up
    np.testing.assert_allclose(again.depth_from_color, capture.depth_from_color)
    depth_m = again.frames[0].read_depth_m()
    assert depth_m.shape == (
        again.frames[0].depth_camera.height,
        again.frames[0].depth_camera.width,
    )
    assert 1.0 < np.median(depth_m[depth_m > 0]) < 5.0


def test_names_are_unique_and_in_order(captured):
    _, capture, _ = captured
    names = [frame.name for frame in capture.frames]
    assert len(set(names)) == len(names)
    times = [frame.time_s for frame in capture.frames if frame.time_s is not None]
    assert times == sorted(times)


def poses_csv(path: Path, names: list[str], poses: np.ndarray, lost: int = 0) -> Path:
    """Poses as localize writes them, the last ones not localized."""
    quat_wxyz = Rotation.from_matrix(poses[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
    lines = ["image,tx,ty,tz,qw,qx,qy,qz,status,inliers,confidence"]
    for index, name in enumerate(names):
        there = index < len(names) - lost
        values = [*poses[index, :3, 3], *quat_wxyz[index]] if there else [""] * 7
        end = "localized,90,0.999" if there else "not localized,0,0.0"
        lines.append(",".join([name, *map(str, values), end]))
    path.write_text("\n".join(lines) + "\n")
    return path


def named(frame) -> str:
    return f"elsewhere/{Path(frame.color_file or frame.name).name}"


def test_poses_of_photographs_kept_aside_are_scored(captured, tmp_path):
    """A shift of 10 cm is found in every format; one that was not localized counts as lost."""
    name, capture, world_from_room = captured
    if name == "7scenes":
        pytest.skip("read as a data set, with its splits")
    aside = list(range(3, 19, 4))
    poses = (world_from_room @ shots().room_from_cam)[aside]
    poses[:, 0, 3] += 0.1
    file = poses_csv(
        tmp_path / "poses.csv", [named(capture.frames[index]) for index in aside], poses, lost=1
    )
    found = synfeal.evaluate(capture.path, file)
    assert len(found.frames.names) == len(aside)
    np.testing.assert_allclose(found.errors["position_m"], [0.1, 0.1, 0.1, np.inf], atol=1e-5)
    np.testing.assert_allclose(found.errors["orientation_deg"][:3], 0.0, atol=1e-4)


def test_poses_of_another_capture_are_refused(captured, tmp_path):
    _, capture, _ = captured
    if capture.format == "7scenes":
        pytest.skip("read as a data set, with its splits")
    file = poses_csv(tmp_path / "poses.csv", ["IMG_1.jpg"], shots().room_from_cam[:1])
    with pytest.raises(InputError, match="none of its 1 poses is of a photograph of"):
        synfeal.evaluate(capture.path, file)


def test_inspected_it_says_what_it_holds(captured, tmp_path, capsys):
    name, capture, world_from_room = captured
    out = tmp_path / "inspected"
    assert main(["inspect", str(capture.path), "--out", str(out)]) == 0
    facts = json.loads((out / "capture-inspect.json").read_text())
    place_m = (world_from_room @ shots().room_from_cam)[:, :3, 3]
    assert (facts["format"], facts["frames"], facts["frames_with_depth"]) == (
        capture.format,
        len(place_m),
        len(place_m),
    )
    np.testing.assert_allclose(facts["extent_m"], np.ptp(place_m, axis=0), atol=1e-3)
    assert facts["color"]["focal_px"] == pytest.approx([FOCAL_PX] * 2, abs=0.01)
    near, middle, far = facts["depth"]["range_m"]
    assert 0.0 < near < middle < far < 7.0  # the diagonal of the room is 7 m
    if name == "3d-scanner-app":
        assert facts["clock"]["interval_s"] == pytest.approx(0.1)
    for picture in ("capture-frames.png", "capture-path.png"):
        with Image.open(out / picture) as image:
            assert min(image.size) >= 400
    assert f"synfeal build {capture.path}" in capsys.readouterr().out


LOST_PHOTOGRAPHS = {
    "arkitscenes": ("lowres_wide/*.png", "1 of 40 calibrations have no photograph"),
    "colmap": ("images/hall/*20.png", "1 images are missing (hall/my photo 020.png, ...)"),
    "polycam": ("keyframes/corrected_images/*.jpg", "1 cameras have no image"),
    "scannet": ("color/27.jpg", "1 of 41 poses have no photograph (27, ...)"),
    "transforms": ("images/*20.png", "1 images are missing (images/frame_00020.png, ...)"),
}


@pytest.mark.parametrize("name", LOST_PHOTOGRAPHS)
def test_a_photograph_that_is_missing_is_told(name, tmp_path):
    path, _ = written(name, tmp_path)
    files, said = LOST_PHOTOGRAPHS[name]
    found = sorted(path.glob(files))
    found[len(found) // 2].unlink()
    facts = capture_facts(read_capture(path))
    assert facts["frames"] == len(shots().rgb) - 1
    assert any(said in line for line in facts["missing"])


def test_options_of_meshes_are_refused_for_captures(tmp_path, capsys):
    path, _ = written("7scenes", tmp_path)
    assert main(["inspect", str(path), "--unit", "2"]) == 1
    assert "--unit: is of meshes" in capsys.readouterr().err


@pytest.fixture(scope="module")
def benchmark_sequence(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("tum") / "room"
    tum(folder)
    return folder


def test_a_sequence_of_the_tum_benchmark_comes_back(benchmark_sequence):
    capture = read_capture(benchmark_sequence)
    assert capture.format == "tum"
    expected = LEANING_FROM_ROOM @ shots().room_from_cam[: len(capture)]
    np.testing.assert_allclose(capture.world_from_cam, expected, atol=WRITTEN_TO)
    depth_m, small_m = capture.frames[5].read_depth_m(), shots().depth_m[5]
    assert depth_m.shape == (480, 640)
    assert np.median(depth_m) == pytest.approx(np.median(small_m), rel=0.2)  # another lens
    assert "uncalibrated Kinect" in capture.notes[0]


@pytest.mark.parametrize("by", ["names", "times"])
def test_poses_of_the_tum_benchmark_are_scored(by, benchmark_sequence, tmp_path):
    capture = read_capture(benchmark_sequence)
    poses = capture.world_from_cam[2:9].copy()
    poses[:, 1, 3] -= 0.02
    if by == "names":
        names = [frame.color_file.name for frame in capture.frames[2:9]]
        file = poses_csv(tmp_path / "poses.csv", names, poses)
    else:
        quat_xyzw = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
        file = tmp_path / "estimate.txt"
        rows = [
            " ".join(map(str, (frame.name, *pose[:3, 3], *quat)))
            for frame, pose, quat in zip(capture.frames[2:9], poses, quat_xyzw, strict=True)
        ]
        file.write_text("\n".join(rows) + "\n")
    found = synfeal.evaluate(benchmark_sequence, file)
    np.testing.assert_allclose(found.errors["position_m"], [0.02] * 7, atol=1e-5)


def test_a_phone_that_focuses_anew_is_drawn_as_one_camera(tmp_path):
    """Frames at other focal lengths show a point of the world where the common camera would."""
    path, _ = written("transforms", tmp_path)
    values = json.loads((path / "transforms.json").read_text())
    for index, entry in enumerate(values["frames"]):
        entry["fl_x"] = entry["fl_y"] = FOCAL_PX * (1.0 + 0.01 * (index % 3 - 1))
    (path / "transforms.json").write_text(json.dumps(values))
    capture = read_capture(path)
    done = unpack(capture, tmp_path / "sequence")
    assert done.color.fx == pytest.approx(FOCAL_PX)
    sequence = read_posed_sequence(done.folder)
    for number, frame in enumerate(capture.frames[:3]):
        changed = frame.camera.fx != pytest.approx(FOCAL_PX)
        assert sequence.color[number].suffix == (".jpg" if changed else ".png")


def test_frames_of_another_size_or_without_depth_are_left_out_and_told(tmp_path):
    path, _ = written("3d-scanner-app", tmp_path)
    (path / "depth_00003.png").unlink()
    done = unpack(read_capture(path), tmp_path / "sequence")
    assert len(done.names) == len(shots().rgb) - 1
    assert any("1 frames have no depth" in note for note in done.notes)
    assert any("no photograph" in note for note in done.notes)


def test_large_photographs_become_smaller_and_their_camera_with_them(tmp_path):
    """Where the optical axis meets the image stays the same share of its sides."""
    path, _ = written("colmap", tmp_path)
    done = unpack(read_capture(path), tmp_path / "sequence", longest_px=120)
    assert (done.color.width, done.color.height) == (120, 90)
    assert done.color.fx / 120 == pytest.approx(FOCAL_PX / WIDTH)
    small = np.asarray(Image.open(tmp_path / "sequence" / "frame-000000.color.jpg"), float)
    blocks = shots().rgb[0].reshape(90, 2, 120, 2, 3).mean(axis=(1, 3))
    assert np.abs(small - blocks).mean() < 3.0


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_a_text_model_of_colmap_needs_neither_second_lines_nor_points(ending, tmp_path):
    path, world_from_room = written("colmap", tmp_path)
    model = path / "sparse/0"
    images = [line for line in (model / "images.txt").read_text().splitlines() if line]
    (model / "images.txt").write_bytes("".join(line + ending for line in images).encode())
    (model / "points3D.txt").unlink()
    found = read_capture(path)
    assert [frame.name for frame in found.frames] == [line.split(None, 9)[9] for line in images]
    np.testing.assert_allclose(
        found.world_from_cam, world_from_room @ shots().room_from_cam, atol=1e-9
    )


def test_a_binary_model_of_colmap_needs_no_points(tmp_path):
    path, world_from_room = written("colmap-binary", tmp_path)
    (path / "sparse/0/points3D.bin").unlink()
    found = read_capture(path)
    np.testing.assert_allclose(
        found.world_from_cam, world_from_room @ shots().room_from_cam, atol=1e-9
    )


CAMERA_LINE = "1 PINHOLE 40 30 30 30 20 15\n"
IMAGE_LINES = "1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 1 0 0 1 b.png\n\n"


@pytest.mark.parametrize(
    ("cameras", "images", "words"),
    [
        (CAMERA_LINE.replace("PINHOLE", "FOO"), IMAGE_LINES, "camera 1: MODEL: 'FOO'"),
        (CAMERA_LINE.replace("PINHOLE", "SIMPLE_DIVISION"), IMAGE_LINES, "MODEL: 'SIMPLE_DIVI"),
        ("1 PINHOLE 40 30 30\n", IMAGE_LINES, "PARAMS: must hold 4 numbers, found 1"),
        (CAMERA_LINE.replace("20", "abc"), IMAGE_LINES, "PARAMS: must hold numbers"),
        (CAMERA_LINE.replace("1 P", "7 P"), IMAGE_LINES, "camera 1 is missing"),
        (CAMERA_LINE, "", "has no image with a pose"),
        (CAMERA_LINE, IMAGE_LINES.replace("2 1 0", "2 x 0"), "line 3 is no image"),
        (b"\1" + bytes(7) + b"\1", b"\1" + bytes(7) + b"\1", "it is too short for 1 images"),
        (b"", b"", "cannot be read as a COLMAP model"),
        (None, IMAGE_LINES, "cameras.txt: missing, and the images of a COLMAP model are there"),
    ],
)
def test_a_damaged_model_of_colmap_is_told_in_our_words(cameras, images, words, tmp_path):
    """A binary one may claim more than memory holds."""
    end = "bin" if isinstance(cameras, bytes) else "txt"
    for name in "ab":
        (tmp_path / "images").mkdir(exist_ok=True)
        Image.new("RGB", (40, 30)).save(tmp_path / f"images/{name}.png")
    for kind, content in (("cameras", cameras), ("images", images)):
        if content is None:
            continue
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / f"{kind}.{end}").write_bytes(data)
    with pytest.raises(InputError) as refusal:
        read_capture(tmp_path)
    assert words in str(refusal.value)


def test_low_confidence_is_no_measurement(tmp_path):
    path, _ = written("3d-scanner-app", tmp_path)
    sure = np.full(shots().small_depth_m[0].shape, 2, np.uint8)
    sure[:, :50] = 0
    Image.fromarray(sure).save(path / "conf_00000.png")
    depth_m = read_capture(path).frames[0].read_depth_m()
    assert (depth_m[:, :50] == 0).all()
    assert (depth_m[:, 50:] > 0).any()


def test_a_capture_of_a_program_without_vertical_says_nothing_of_up(tmp_path):
    path, _ = written("colmap", tmp_path)
    assert read_capture(path).up is None
    assert not np.allclose(Y_UP_FROM_ROOM, Z_UP_FROM_ROOM)


def test_every_format_says_where_it_is_described():
    for one in capture_formats().values():
        assert isinstance(one, CaptureFormat)
        assert one.source
        assert one.marks


BROKEN = [
    ("transforms", "transforms.json", "{", "transforms.json"),
    ("transforms", "transforms.json", '{"frames": []}', "'frames' is empty"),
    ("transforms", "transforms.json", '{"frames": [{"file_path": "../x.png"}]}', "leads out"),
    ("transforms", "transforms.json", '{"frames": [{"file_path": "x.png"}]}', "missing"),
    ("polycam", "keyframes/corrected_cameras/1700000000000000.json", "{}", "'t_00' is missing"),
    ("3d-scanner-app", "frame_00000.json", '{"cameraPoseARFrame": [1, 2]}', "frame_00000.json"),
    ("stray-scanner", "odometry.csv", "timestamp,frame\n1,2\n", "no column 'x'"),
    ("stray-scanner", "camera_matrix.csv", "1,2\n3,4\n", "three rows"),
    ("arkitscenes", "lowres_wide.traj", "1 2 3\n", "7 finite numbers"),
    ("scannet", "intrinsic/intrinsic_color.txt", "1 2", "16 finite numbers"),
    ("12scenes", "info.txt", "m_colorWidth = 5\n", "is missing"),
    ("colmap", "sparse/0/cameras.txt", "1 PINHOLE x\n", "sparse/0"),
]


def see_all(path: Path) -> None:
    for frame in read_capture(path).frames:
        frame.read_color()


@pytest.mark.parametrize(("name", "file", "content", "said"), BROKEN)
def test_damage_is_one_line_that_names_the_file(name, file, content, said, tmp_path):
    path, _ = written(name, tmp_path)
    (path / file).write_text(content)
    with pytest.raises(InputError, match=said) as refused:
        see_all(path)
    assert str(path) in str(refused.value)


def test_what_is_no_capture_is_told_what_one_is(tmp_path):
    with pytest.raises(InputError, match=r"no capture that is known.*Polycam"):
        format_of(tmp_path)
    with pytest.raises(InputError, match="not there"):
        format_of(tmp_path / "nothing")


def test_pictures_without_poses_are_told_what_they_lack(tmp_path):
    for folder in ("rgb", "depth"):
        (tmp_path / folder).mkdir()
        for number in range(3):
            (tmp_path / folder / f"{number}.png").touch()
    lacking = r"3 in depth, 3 in rgb\), but nothing known with their poses.*COLMAP"
    for call in (format_of, synfeal.inspect, lambda path: synfeal.build(path, tmp_path / "place")):
        with pytest.raises(InputError, match=lacking):
            call(tmp_path)


def test_images_are_found_where_the_folders_before_them_are_left_out(tmp_path):
    path, _ = written("transforms", tmp_path)
    expected = read_capture(path)
    values = json.loads((path / "transforms.json").read_text())
    for frame in values["frames"]:
        for name in ("file_path", "depth_file_path"):
            frame[name] = f"./data/phone/{frame[name]}"
    (path / "transforms.json").write_text(json.dumps(values))
    found = read_capture(path)
    assert any("without the first 2 folders" in note for note in found.notes)
    for one, other in zip(found.frames, expected.frames, strict=True):
        assert one.name == other.name
        assert np.array_equal(one.world_from_cam, other.world_from_cam)
        assert np.array_equal(one.read_color(), other.read_color())
        assert np.array_equal(one.read_depth_m(), other.read_depth_m())


def test_a_folder_that_is_two_captures_asks_which(tmp_path):
    path, _ = written("transforms", tmp_path)
    WRITERS["colmap"](path)
    with pytest.raises(InputError, match="`format`"):
        read_capture(path)
    assert read_capture(path, "colmap").format == "colmap"
    assert read_capture(path, "transforms").format == "transforms"
    with pytest.raises(InputError, match="none of"):
        read_capture(path, "fbx")


PAGE = ROOT / "docs" / "adding.md"
READ = """
from pathlib import Path
import synfeal
from synfeal.captures.formats import read_capture
from synfeal.errors import InputError
capture = read_capture(Path("cart"))
frame = capture.frames[1]
print(capture.format, len(capture), frame.world_from_cam[0, 3], frame.read_color().shape)
print(float(frame.read_depth_m()[5, 7]))
made = synfeal.unpack("cart", "sequence")
print(len(list(Path("sequence").glob("*.pose.txt"))), "written")
table = Path("cart/cart.csv")
table.write_text(table.read_text().replace("qz", "q3"))
try:
    read_capture(Path("cart"))
except InputError as error:
    print(error)
"""


def test_a_format_of_another_package_is_found_and_read(tmp_path):
    """The example of the page, installed as a person would."""
    text = re.search(r"`my_captures/cart\.py`:\n\n```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (tmp_path / "my_captures").mkdir()
    (tmp_path / "my_captures/__init__.py").touch()
    (tmp_path / "my_captures/cart.py").write_text(text[1])
    info = tmp_path / "my_captures-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-captures\nVersion: 1.0\n")
    entry = "[synfeal.captures]\ncart = my_captures.cart:FORMAT\n"
    (info / "entry_points.txt").write_text(entry)
    cart = tmp_path / "cart"
    cart.mkdir()
    rows = ["number,x,y,z,qx,qy,qz,qw", "0,0,0,0,0,0,0,1", "1,2.5,0,0,0,0,0,1"]
    (cart / "cart.csv").write_text("\n".join(rows) + "\n")
    for number in range(2):
        Image.new("RGB", (640, 480)).save(cart / f"{number:04d}.png")
        depth_mm = np.full((480, 640), 1250, np.uint16)
        Image.fromarray(depth_mm).save(cart / f"{number:04d}.depth.png")
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    done = subprocess.run(
        [sys.executable, "-c", READ],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines() == [
        "cart 2 2.5 (480, 640, 3)",
        "1.25",
        "2 written",
        "cart/cart.csv: column qz missing; its columns are number, x, y, z, qx, qy, q3, qw; record"
        " the capture again",
    ]


def test_a_capture_without_photographs_is_refused_whatever_reads_it(tmp_path):
    with pytest.raises(InputError, match="holds no photographs, read as cart"):
        Capture(tmp_path, "cart", ())


@pytest.mark.parametrize("name", ["polycam", "scannet", "record3d", "transforms"])
def test_scanned_without_an_option_it_is_the_room(name, tmp_path):
    """Calibrations, depth scale and axes all come with the capture."""
    o3d = pytest.importorskip("open3d")
    path, world_from_room = written(name, tmp_path)
    done = unpack(read_capture(path), tmp_path / "sequence")
    made = scan(ScanJob(done.folder, tmp_path / "scan.glb", voxel_m=0.02, max_depth_m=6.0))
    record = made.record
    if read_capture(path).up is not None:
        assert record["gravity"] == "sensed by the device"
    room_from_world = inverse(world_from_room) @ np.array(record["sequence_from_world"])
    np.testing.assert_allclose(room_from_world[2, :3], [0, 0, 1], atol=0.01)  # it stands upright
    vertices = made.mesh.merged()[0] @ room_from_world[:3, :3].T + room_from_world[:3, 3]
    true_vertices, true_faces = furnished_room((4.0, 12.0, 40.0)).merged()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(true_vertices.astype(np.float32), true_faces.astype(np.uint32))
    distance_m = scene.compute_distance(vertices.astype(np.float32)).numpy()
    assert np.median(distance_m) < 0.005
    assert np.quantile(distance_m, 0.9) < 0.01


def test_the_command_says_what_it_found_and_what_comes_next(tmp_path, capsys, caplog):
    path, _ = written("3d-scanner-app", tmp_path)
    out = tmp_path / "sequence"
    assert main(["unpack", str(path), "--out", str(out), "--stride", "4"]) == 0
    said = capsys.readouterr().out
    assert "40 frames of 3d Scanner App" in said
    assert f"{out}: 10 frames, 240 x 180 pixels, focal length 180, depth 120 x 90" in said
    assert f"synfeal scan {out} --out scan.glb" in said
    assert "no photograph" in caplog.text
    assert len(list(out.glob("*.pose.txt"))) == 10


@pytest.mark.parametrize(
    ("options", "said"),
    [(["--stride", "0"], "--stride"), (["--format", "fbx"], "fbx is none of tum, 7scenes")],
)
def test_bad_options_are_one_line_and_write_nothing(options, said, tmp_path, capsys):
    path, _ = written("colmap", tmp_path)
    assert main(["unpack", str(path), "--out", str(tmp_path / "out"), *options]) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
