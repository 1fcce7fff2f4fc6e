"""Data sets on disk: 7-Scenes files, packed frames, manifests, and what prepares a scene."""

import hashlib
import json
import weakref

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from synfeal.collection.prepare import prepare_scene
from synfeal.config.collection import SceneConfig
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset import sevenscenes
from synfeal.dataset.depth import encode_depth, read_depth_m
from synfeal.dataset.finish import write_manifest
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.dataset.preview import write_contact_sheet
from synfeal.dataset.render_sequence import MOST_WAITING, render_sequence, write_sequence
from synfeal.dataset.sequence_listing import list_sequences
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix, quat_wxyz_of
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.load import load_mesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import load_collision_mesh
from synfeal.records.files import atomic_directory
from synfeal.render.surface import Layers
from synfeal.validation.manifest import check_manifest
from tests.support.collected import painted

CAMERA = CameraConfig(width=40, height=30)


def poses_of(count):
    rng = np.random.default_rng(0)
    rpy, position_m = rng.uniform(-0.5, 0.5, (2, count, 3))
    poses = pose_matrix(rotation_from_rpy(rpy), position_m)
    index = np.arange(count)
    return PoseTable(index, index, poses[:, :3, 3].copy(), quat_wxyz_of(poses))


ROOM = painted(trimesh.creation.box((4.0, 4.0, 4.0)))


class FakeRenderer:
    """Frames that say which pose they show; breaks after ``limit`` frames."""

    def __init__(self, limit=1000):
        self.limit = limit

    def render_rgbd(self, world_from_cam):
        self.limit -= 1
        if self.limit < 0:
            raise RuntimeError("the graphics card is on fire")
        x = world_from_cam[0, 3]
        return np.full((4, 6, 3), 100 + 100 * x, np.uint8), np.full((4, 6), 1 + x, np.float32)

    def render(self, world_from_cam):
        return self.render_rgbd(world_from_cam)[0]


@given(st.integers(0, 300), st.integers(0, 300), st.integers(1, 60))
def test_sequences_cover_every_frame_once(n_train, n_test, shard):
    sequences = sevenscenes.sequences_of(n_train, n_test, shard)
    for split, count in (("train", n_train), ("test", n_test)):
        frames = [i for s in sequences if s.split == split for i in range(s.start, s.stop)]
        assert frames == list(range(count))
    assert all(1 <= len(sequence) <= shard for sequence in sequences)
    assert [s.number for s in sequences] == list(range(1, len(sequences) + 1))


def test_split_files_are_those_of_7_scenes(tmp_path):
    sevenscenes.write_splits(tmp_path, sevenscenes.sequences_of(5, 3, 3))
    for name, text in {"Train": "sequence1\nsequence2\n", "Test": "sequence3\n"}.items():
        assert (tmp_path / f"{name}Split.txt").read_text() == text
    assert sevenscenes.read_split(tmp_path, "train") == [tmp_path / "seq-01", tmp_path / "seq-02"]
    (tmp_path / "TestSplit.txt").write_text("seq-3\n")
    with pytest.raises(InputError, match="seq-3"):
        sevenscenes.read_split(tmp_path, "test")


def test_depth_is_16_bit_millimetres_and_a_pose_four_exact_rows(tmp_path):
    depth = np.array([[0.5, 1.2344, np.inf], [65.534, 65.536, 100.0]], np.float32)
    (tmp_path / "depth.png").write_bytes(encode_depth(depth))
    stored = np.asarray(Image.open(tmp_path / "depth.png"))
    assert stored.tolist() == [[500, 1234, 65535], [65534, 65535, 65535]]
    back = read_depth_m(tmp_path / "depth.png")
    np.testing.assert_allclose(back[0, :2], [0.5, 1.234], atol=1e-6)
    assert np.isinf(back[[0, 1, 1], [2, 1, 2]]).all()
    pose = poses_of(1).world_from_cam[0]
    (tmp_path / "pose.txt").write_text(sevenscenes.pose_text(pose))
    rows = (tmp_path / "pose.txt").read_text().splitlines()
    assert [len(row.split()) for row in rows] == [4, 4, 4, 4]
    np.testing.assert_allclose(sevenscenes.read_pose(tmp_path / "pose.txt"), pose, atol=1e-10)


def test_rendered_sequence_holds_what_the_poses_see(tmp_path):
    save_glb(tmp_path / "mesh.glb", ROOM)
    poses = poses_of(3)
    write_pose_table(tmp_path / "plan.csv", poses)
    directory = tmp_path / "out" / "seq-01"
    rows, files = (tmp_path / "plan.csv", 0, 3), (tmp_path / "mesh.glb", CAMERA)
    render_sequence(*files, *rows, True, RenderConfig(), directory)
    assert len(list(directory.iterdir())) == 9
    found = {p.name for p in directory.glob("*000001*")}
    assert found == {f"frame-000001.{kind}" for kind in ("color.png", "depth.png", "pose.txt")}
    for index, path in enumerate(sevenscenes.frame_paths([directory], "pose.txt")):
        np.testing.assert_allclose(
            sevenscenes.read_pose(path), poses.world_from_cam[index], atol=1e-9
        )
    centre = read_depth_m(directory / "frame-000002.depth.png")[15, 20]
    origin, forward = poses.position_m[2], poses.world_from_cam[2, :3, 2]
    wall = np.min((2.0 - np.sign(forward) * origin) / np.abs(forward))  # the box is 4 m wide
    assert centre == pytest.approx(wall, abs=0.05)
    with Image.open(directory / "frame-000000.color.png") as frame:
        assert frame.size == (40, 30)


class Remembering:
    """Counts frames that were handed over and not yet written, as ``write_sequence`` sees them."""

    def __init__(self):
        self.shown, self.most = [], 0

    def render(self, world_from_cam):
        rgb = np.full((240, 320, 3), len(self.shown) % 256, np.uint8)
        self.shown.append(weakref.ref(rgb))
        self.most = max(self.most, sum(shown() is not None for shown in self.shown))
        return rgb


def test_only_some_frames_wait_to_be_written(tmp_path):
    renderer = Remembering()
    write_sequence(renderer, poses_of(300), tmp_path / "seq-01", Layers())
    assert renderer.most <= MOST_WAITING + 2
    for index in (0, 100, 299):
        with Image.open(tmp_path / "seq-01" / f"frame-{index:06d}.color.png") as frame:
            assert frame.getpixel((160, 120)) == (index % 256,) * 3


def test_nothing_is_left_half_written_overwritten_or_taken_for_frames(tmp_path):
    with pytest.raises(RuntimeError, match="on fire"):
        write_sequence(FakeRenderer(2), poses_of(5), tmp_path / "seq-01", Layers(depth=True))
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    with pytest.raises(InputError, match="not empty"), atomic_directory(tmp_path / "mine"):
        pass
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "years of work"
    (tmp_path / "seq-04").mkdir()
    with pytest.raises(InputError, match="seq-04"):
        sevenscenes.frame_paths([tmp_path / "seq-04"], "color.png")


def write_frames(directory, values, size=(40, 30)):
    directory.mkdir()
    for index, value in enumerate(values):
        Image.new("RGB", size, (value, 0, 0)).save(directory / f"frame-{index:06d}.color.png")


@pytest.mark.parametrize("shape", [(1, 1, 3), (7, 5, 3), (1, 1), (7, 5)])
@pytest.mark.parametrize("kind", ["noise", "flat"])
def test_png_files_hold_the_pixels(tmp_path, shape, kind):
    dtype = np.uint8 if len(shape) == 3 else np.uint16
    most = np.iinfo(dtype).max
    pixels = np.random.default_rng(0).integers(0, most + 1, shape).astype(dtype)
    if kind == "flat":
        pixels[:] = most
    path = tmp_path / "frame.png"
    path.write_bytes(encode_png(pixels))
    with Image.open(path) as image:
        assert image.mode == ("RGB" if len(shape) == 3 else "I;16")
        np.testing.assert_array_equal(np.asarray(image), pixels)
    again = np.ascontiguousarray(pixels[::-1])[::-1]  # any memory layout will do
    assert encode_png(again) == path.read_bytes()


def test_other_pixels_are_no_frames():
    for shape, kind in (((4, 4), np.uint8), ((4, 4, 4), np.uint8), ((4, 4, 3), float)):
        with pytest.raises(ValueError, match="cannot encode"):
            encode_png(np.zeros(shape, kind))


def test_manifest_finds_a_changed_pixel(tmp_path):
    write_frames(tmp_path / "seq-01", [1, 2])
    write_frames(tmp_path / "seq-02", [3])
    write_manifest(tmp_path, sevenscenes.sequences_of(2, 1, 2), CAMERA, {"scene": "room"})
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["frames"] == {"train": 2, "test": 1}
    assert manifest["camera"]["fx"] == pytest.approx(20 / np.tan(np.pi / 6))
    assert (manifest["camera"]["cx"], manifest["camera"]["cy"]) == (20.0, 15.0)
    assert manifest["scene"] == "room"
    assert not check_manifest(tmp_path, list_sequences(tmp_path), {}, int).failures
    Image.new("RGB", (40, 30), (9, 9, 9)).save(tmp_path / "seq-02" / "frame-000000.color.png")
    (failure,) = check_manifest(tmp_path, list_sequences(tmp_path), {}, int).failures
    assert "seq-02: differs from what was written" in failure


def test_contact_sheet_shows_frames_in_reading_order(tmp_path):
    write_frames(tmp_path / "seq-01", list(range(0, 240, 5)))  # 48 frames: every second is shown
    paths = sevenscenes.frame_paths([tmp_path / "seq-01"], "color.png")
    write_contact_sheet(paths, tmp_path / "preview.png")
    with Image.open(tmp_path / "preview.png") as sheet:
        assert sheet.size == (6 * 240, 4 * 180)
        assert sheet.getpixel((100, 90)) == (0, 0, 0)
        assert sheet.getpixel((340, 90)) == (10, 0, 0)
        assert sheet.getpixel((100, 270)) == (60, 0, 0)


def test_a_mesh_scene_is_prepared(tmp_path):
    save_glb(tmp_path / "room.glb", ROOM)
    sha256 = hashlib.sha256((tmp_path / "room.glb").read_bytes()).hexdigest()
    scene = SceneConfig(source="mesh", path=tmp_path / "room.glb", sha256=sha256, unit_m=2.0)
    prepare_scene("room", scene, 0.995, 0, tmp_path / "out" / "mesh.glb")
    properties = json.loads((tmp_path / "out" / "properties.json").read_text())
    assert (properties["vertices"], properties["faces"]) == (8, 12)
    assert properties["volume_m3"] == pytest.approx(512.0)  # 4 units of 2 m, cubed
    np.testing.assert_allclose(load_mesh(tmp_path / "out" / "mesh.glb").bounds_m[1], 4.0)
    np.testing.assert_allclose(load_collision_mesh(tmp_path / "out" / "collision.ply")[0].max(), 4)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"sha256": "0" * 64}, "expected 0000"),
        ({"sampling_box": {"x": [50, 60], "y": [0, 1], "z": [0, 1]}}, "unit_m"),
        ({"path": "nowhere.glb", "sha256": "0" * 64}, "does not exist"),
        ({"path": "nowhere.glb"}, "no such mesh file"),
    ],
)
def test_a_scene_that_contradicts_its_config_is_refused(tmp_path, values, message):
    save_glb(tmp_path / "room.glb", ROOM)
    scene = SceneConfig.model_validate({"source": "mesh", "path": tmp_path / "room.glb", **values})
    with pytest.raises(InputError, match=message):
        prepare_scene("room", scene, 0.995, 0, tmp_path / "out" / "mesh.glb")
    assert not (tmp_path / "out").exists()
