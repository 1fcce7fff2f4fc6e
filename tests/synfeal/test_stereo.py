"""Stereo pairs: disparity is f b / depth, and every reader has both images of every frame."""

import json
import shutil

import numpy as np
import open3d as o3d
import pycolmap
import pytest
from PIL import Image

import synfeal
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.images import read_rgb
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.preview import TILE_WIDTH_PX
from synfeal.dataset.render_sequence import write_sequence
from synfeal.effects.scene import SceneRenderer
from synfeal.errors import InputError
from synfeal.exporting.run import export
from synfeal.geometry.poses import pose_matrix, quat_wxyz_of
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.render.surface import Layers
from tests.support.collected import collect, refused, save_room
from tests.support.small_room import facing_quad, furnished_room, paint

BASELINE_M = 0.12
AHEAD = pose_matrix(rotation_from_rpy([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Ten frames of a furnished room, training and test."""
    folder = tmp_path_factory.mktemp("stereo")
    save_glb(folder / "room.glb", furnished_room((4.0, 12.0)))
    return synfeal.collect(
        folder / "room.glb",
        folder / "pairs",
        7,
        test_frames=3,
        depth=True,
        stereo_m=BASELINE_M,
        width=96,
        height=72,
        spacing_m=0.1,
        box=[(0.8, 4.2, 0.8, 3.2, 1.0, 1.8)],
    )


def metres(file):
    depth_mm = np.asarray(Image.open(file)).astype(float)
    return np.where(depth_mm == 65535, np.inf, depth_mm / 1000)


def test_a_plane_is_moved_by_whole_pixels_as_its_disparity_says(tmp_path):
    """f b / z = 100 px x 0.1 m / 2 m = 5 px: the right image is the left one, 5 pixels on."""
    texture = paint(np.random.default_rng(0), (3.0, 9.0))
    plane = TexturedMesh((facing_quad(2.0, 4.0, texture),))
    camera = CameraConfig(width=120, height=80, fx=100, fy=100, cx=60, cy=40)
    table = PoseTable(np.arange(1), np.zeros(1, int), np.zeros((1, 3)), quat_wxyz_of(AHEAD[None]))
    with SceneRenderer(plane, camera, synfeal.config.dataset.RenderConfig()) as renderer:
        write_sequence(
            renderer, table, tmp_path / "seq-01", Layers(depth=True), stereo_baseline_m=0.1
        )
    left = read_rgb(tmp_path / "seq-01/frame-000000.color.png").astype(int)
    right = read_rgb(tmp_path / "seq-01/frame-000000.right.color.png").astype(int)
    assert left.std() > 10
    assert np.abs(right[:, :-5] - left[:, 5:]).max() <= 2
    assert np.abs(right[:, :-4] - left[:, 4:]).mean() > 2
    assert (metres(tmp_path / "seq-01/frame-000000.right.depth.png") == 2.0).all()


def test_disparity_is_f_b_over_depth(dataset):
    """Rays cast through u - f b / z of the right camera meet what the left one shows at u."""
    vertices, faces = furnished_room((4.0, 12.0)).merged()
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(faces.astype(np.uint32))
    )
    fx, fy, cx, cy = dataset.camera.intrinsics
    column, row = np.meshgrid(np.arange(96) + 0.5, np.arange(72) + 0.5)
    for split in (dataset.train, dataset.test):
        for file, pose in zip(split.depths, split.right.world_from_cam, strict=True):
            left_m = metres(file)
            moved = column - fx * BASELINE_M / left_m
            inside = moved > 0.5
            ray = np.stack([(moved - cx) / fx, (row - cy) / fy, np.ones_like(row)], axis=-1)[inside]
            world = ray @ pose[:3, :3].T
            six = np.concatenate([np.broadcast_to(pose[:3, 3], world.shape), world], axis=-1)
            right_m = scene.cast_rays(o3d.core.Tensor(six.astype(np.float32)))["t_hit"].numpy()
            same = np.abs(right_m - left_m[inside]) < 1.5e-3
            # The rest is hidden from the right camera, or leaves whose holes rays do not know.
            assert same.mean() > 0.85
            hidden = right_m[~same] < left_m[inside][~same] + 0.02
            assert hidden.sum() >= 0.6 * (~same).sum()


def test_both_cameras_are_opened_with_their_poses(dataset):
    for split in (dataset.train, dataset.test):
        left, right = split.world_from_cam, split.right.world_from_cam
        offset = np.einsum("nji,nj->ni", left[:, :3, :3], right[:, :3, 3] - left[:, :3, 3])
        np.testing.assert_allclose(offset, np.tile([BASELINE_M, 0, 0], (len(left), 1)), atol=1e-12)
        np.testing.assert_allclose(right[:, :3, :3], left[:, :3, :3], atol=1e-12)
        names = [file.name for file in split.right.images]
        assert names == [file.name.replace(".color", ".right.color") for file in split.images]
        assert len(split.right.images) == len(split.right.depths) == len(split.depths) == len(split)
    stereo = json.loads((dataset.path / "manifest.json").read_text())["stereo"]
    assert stereo["baseline_m"] == BASELINE_M
    np.testing.assert_allclose(np.array(stereo["left_from_right"])[:3, 3], [BASELINE_M, 0, 0])


def test_no_wall_is_between_the_cameras(dataset):
    settings = json.loads((dataset.path / "manifest.json").read_text())
    assert settings["scene"]["min_clearance_m"] == BASELINE_M


def test_validate_passes_and_finds_what_is_wrong_with_a_right_image(dataset, tmp_path):
    assert synfeal.validate(dataset.path) == []
    image = dataset.train.right.images[2]
    sound = image.read_bytes()
    manifest = dataset.path / "manifest.json"
    written = manifest.read_text()
    try:
        image.unlink()
        assert any("000002.right.color.png: missing" in e for e in synfeal.validate(dataset.path))
        image.write_bytes(encode_png(np.zeros((10, 10, 3), np.uint8)))
        assert any("is 10 x 10" in line for line in synfeal.validate(dataset.path))
        image.write_bytes(sound)
        manifest.write_text(
            written.replace('"stereo_baseline_m": 0.12', '"stereo_baseline_m": 0.1')
        )
        assert any(line.startswith("stereo: ") for line in synfeal.validate(dataset.path))
    finally:
        image.write_bytes(sound)
        manifest.write_text(written)


def test_exports_have_both_images_and_colmap_the_rig(dataset, tmp_path):
    assert export(dataset.path, "colmap", tmp_path / "colmap", False, None) == 20
    model = pycolmap.Reconstruction(tmp_path / "colmap" / "sparse" / "0")
    poses = {
        image.name: np.vstack([image.cam_from_world().inverse().matrix(), [0, 0, 0, 1]])
        for image in model.images.values()
    }
    for number, (left, right) in enumerate(
        zip(dataset.train.world_from_cam, dataset.train.right.world_from_cam, strict=True)
    ):
        name = f"frame-{number:06d}.color.png"
        np.testing.assert_allclose(poses[f"seq-01/{name}"], left, atol=1e-9)
        np.testing.assert_allclose(poses[f"seq-01-right/{name}"], right, atol=1e-9)
    rigs = pycolmap.read_rig_config(tmp_path / "colmap" / "rig_config.json")
    assert [camera.image_prefix for camera in rigs[0].cameras] == ["seq-01/", "seq-01-right/"]
    right_from_left = rigs[0].cameras[1].cam_from_rig.matrix()
    np.testing.assert_allclose(right_from_left[:, 3], [-BASELINE_M, 0, 0])
    assert export(dataset.path, "tum", tmp_path / "tum", False, None) == 20
    lines = (tmp_path / "tum" / "seq-01-right" / "groundtruth.txt").read_text().splitlines()
    position = np.array(lines[3].split()[1:4], float)
    np.testing.assert_allclose(position, dataset.train.right.world_from_cam[0, :3, 3], atol=1e-9)


def test_a_preview_shows_both_images_side_by_side(dataset, tmp_path, capfd):
    """All left images are white, all right ones grey."""
    folder = shutil.copytree(dataset.path, tmp_path / "set")
    for kind, level in (("color", 255), ("right.color", 90)):
        for path in (folder / "seq-01").glob(f"frame-*[0-9].{kind}.png"):
            path.write_bytes(encode_png(np.full((72, 96, 3), level, np.uint8)))
    shown = ["--show", "right", "color", "right-depth", "--frames", "2"]
    assert main(["preview", str(folder), "--out", str(tmp_path / "both.gif"), *shown]) == 0
    with Image.open(tmp_path / "both.gif") as opened:
        row = np.asarray(opened.convert("RGB"))[-1]
    assert row.shape == (3 * TILE_WIDTH_PX, 3)
    np.testing.assert_allclose(row[:TILE_WIDTH_PX], 90, atol=2)
    np.testing.assert_allclose(row[TILE_WIDTH_PX : 2 * TILE_WIDTH_PX], 255, atol=2)
    assert row[2 * TILE_WIDTH_PX :].max() > 20
    for path in (folder / "seq-01").glob("*.right.*"):
        path.unlink()
    message = refused(capfd, "preview", folder, "--show", "right")
    assert "has no right; collect it with --stereo BASELINE_M" in message


def test_refusals_are_one_line(tmp_path, capfd):
    mesh = save_room(tmp_path / "room.glb")
    given = ("collect", mesh, "--frames", 4, "--out", tmp_path / "out", "--stereo")
    assert "--stereo" in refused(capfd, *given, 0)
    assert "--stereo" in refused(capfd, *given, "nan")
    effects = tmp_path / "effects.yaml"
    effects.write_text("noise: {}\n")
    assert "effects are of one camera" in refused(capfd, *given, 0.1, "--effects", effects)
    with pytest.raises(InputError, match="stereo"):
        synfeal.Renderer(synfeal.load_mesh(mesh), stereo_m=0.1)
    assert not (tmp_path / "out").exists()


def test_an_archive_holds_both(tmp_path):
    mesh = save_room(tmp_path / "room.glb")
    assert collect(mesh, tmp_path / "out", "--stereo", "0.1", "--archive") == 0
    opened = synfeal.open_dataset(tmp_path / "out")
    assert len(opened.train.right.images) == 24
    assert opened.train.right.images[3].read_bytes()[:4] == b"\x89PNG"
    assert main(["preview", str(tmp_path / "out"), "--frames", "2"]) == 0
