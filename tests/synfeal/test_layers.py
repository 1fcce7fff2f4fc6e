"""Normals and masks: against rays at every triangle, on disk, and through the commands."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import synfeal
from synfeal.camera.projection import rays_of_pixels
from synfeal.cli import main
from synfeal.config.dataset import RenderConfig
from synfeal.dataset.layer_files import (
    mask_pixels,
    normal_pixels,
    normals_of_pixels,
    read_instances,
    read_mask,
    read_normals,
)
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse
from synfeal.mesh.instances import number_instances
from synfeal.mesh.model import TexturedMesh
from synfeal.render import base, open_renderer
from synfeal.render.surface import SurfaceTable
from synfeal.validation.layers import MOST_DEG
from tests.support.brute_rays import Truth, pinhole_rays
from tests.support.collected import collect, refused, save_room
from tests.support.damaged_sets import without_manifest_hashes
from tests.support.ray_scenes import SCENES, scene
from tests.support.small_room import BACKENDS, PYOPENGL_WARNS, camera_of

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)
CAMERA = camera_of(width=44, height=33)
TO_CAMERA = np.array([128, 128, 1], np.uint8)  # 0 0 -1, as normals are stored
LENS = {"fx": 34.0, "fy": 34.0, "cx": 21.0, "cy": 17.0, "distortion": (-0.2, 0.05, 1e-3, 0, 0)}


@pytest.fixture(scope="module", params=SCENES)
def truth(request):
    mesh, pose = scene(request.param)
    return mesh, pose, Truth(mesh, CAMERA, pose, pinhole_rays(CAMERA))


def surface_of(mesh, pose, camera, backend):
    with open_renderer(mesh, camera, RenderConfig(backend=backend)) as renderer:
        faces = renderer.render_faces(pose)
    return faces, SurfaceTable(mesh, camera, number_instances(mesh)).look_up(faces, pose)


@pytest.mark.parametrize("backend", BACKENDS)
def test_normals_and_masks_are_those_of_rays_at_every_triangle(truth, backend):
    """Everywhere but within 0.02 pixels of an edge, where single precision may decide."""
    mesh, pose, rays = truth
    faces, seen = surface_of(mesh, pose, CAMERA, backend)
    assert rays.clear.mean() > 0.9
    np.testing.assert_array_equal(faces[rays.clear], rays.face[rays.clear])
    error = np.abs(seen.normals_cam - rays.normal_cam)[rays.clear]
    assert error.max() < 1e-6
    ids = np.repeat(np.arange(1, len(mesh.parts) + 1), [len(p.faces) for p in mesh.parts])
    expected = np.append(ids, 0)[rays.face]
    np.testing.assert_array_equal(seen.ids[rays.clear], expected[rays.clear])
    assert not seen.normals_cam[seen.ids == 0].any()


@pytest.mark.parametrize(
    "camera",
    [
        {"width": 44, "height": 33, **LENS},
        {"width": 60, "height": 30, "projection": "equirectangular"},
        {"width": 40, "height": 40, "projection": "fisheye", "horizontal_fov_deg": 200.0},
    ],
    ids=["lens", "panorama", "fisheye"],
)
def test_through_a_lens_a_pixel_shows_what_is_at_most_half_a_pixel_away(camera):
    mesh, pose = scene("room")
    camera = camera_of(**camera)
    rays = Truth(mesh, camera, pose, lambda pixel: rays_of_pixels(camera, pixel), margin_px=0.4)
    faces, seen = surface_of(mesh, pose, camera, "raycast")
    shown = rays.clear & (rays.face >= 0)  # in the corners a fisheye shows nothing
    assert shown.mean() > 0.5
    np.testing.assert_array_equal(faces[shown], rays.face[shown])
    np.testing.assert_allclose(seen.normals_cam[shown], rays.normal_cam[shown], atol=1e-6)


def test_meshes_of_many_vertices_and_unseen_parts_keep_their_numbers(monkeypatch):
    mesh, pose = scene("heap")
    unseen = {"base_color": np.zeros(4, np.uint8), "alpha_cutoff": 1.0}
    ghost = replace(mesh.parts[1], **unseen)
    assert not ghost.is_drawn
    with_ghost = TexturedMesh((ghost, *mesh.parts))
    expected, _ = surface_of(mesh, pose, CAMERA, "raycast")
    monkeypatch.setattr(base.pieces, "__defaults__", (30,))
    for backend in BACKENDS:
        found, _ = surface_of(with_ghost, pose, CAMERA, backend)
        same = np.where(expected < 0, -1, expected + len(ghost.faces)) == found
        assert same.mean() > 0.99, backend


def test_stored_normals_are_off_by_two_fifths_of_a_degree_at_most():
    rng = np.random.default_rng(0)
    normal = rng.standard_normal((200, 300, 3))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    normal[0, :6] = [*np.eye(3), *-np.eye(3)]
    normal[1] = 0.0
    stored = normals_of_pixels(normal_pixels(normal))
    np.testing.assert_array_equal(stored[:2, :6], normal[:2, :6])
    assert not stored[1].any()
    error_deg = np.degrees(np.linalg.norm(np.cross(stored, normal), axis=-1))
    assert 0.1 < error_deg.max() < 0.40
    np.testing.assert_array_equal(mask_pixels(np.array([[0, 65535]])), [[0, 65535]])


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    """A closed room with two cartons for all paths, and others along every path."""
    folder = tmp_path_factory.mktemp("layers")
    room = save_room(folder / "room.glb")
    (folder / "clutter.yaml").write_text("{count: 2, seed: 3, size_m: [0.5, 0.9]}")
    (folder / "effects.yaml").write_text("{clutter: {count: 3}}")
    options = ("--depth", "--normals", "--masks", "--archive", "--backend", "raycast")
    options += ("--mode", "random", "--pitch", "10", "29")
    options += ("--clutter", str(folder / "clutter.yaml"))
    options += ("--effects", str(folder / "effects.yaml"))
    assert collect(room, folder / "set", *options) == 0
    return folder / "set"


def points_m(data, row):
    """Return the world points (H, W, 3) of a training frame's pixels, by its depth."""
    camera = data.camera
    column, line = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    fx, fy, cx, cy = camera.intrinsics
    ray = np.stack([(column - cx) / fx, (line - cy) / fy, np.ones_like(column)], axis=-1)
    pose = data.train.world_from_cam[row]
    return (data.train.depth_m(row)[..., None] * ray) @ pose[:3, :3].T + pose[:3, 3]


def in_box(point_m, foot_m, size_m, yaw_deg):
    """Whether points (..., 3) are within 1 cm of an upright box."""
    yaw = np.radians(yaw_deg)
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    own = (point_m - foot_m) @ turn - [0.0, 0.0, size_m[2] / 2]
    return (np.abs(own) <= np.asarray(size_m) / 2 + 0.01).all(axis=-1)


def test_masks_tell_the_mesh_the_objects_in_it_and_those_along_a_path(collected):
    data = synfeal.open_dataset(collected)
    table = data.instances()
    assert [(i.id, i.kind) for i in table.values()] == [(1, "part"), (2, "object"), (3, "object")]
    manifest = json.loads((collected / "manifest.json").read_text())
    assert set(manifest["layers"]) == {"normals", "masks"}
    places = [
        (number, p["position_m"], p["size_m"], p["yaw_deg"])
        for number, p in enumerate(manifest["clutter"], 2)
    ]
    names = (collected / "train.objects.csv").read_text().splitlines()[0].split(",")
    rows = np.genfromtxt(collected / "train.objects.csv", delimiter=",", skip_header=1)
    columns = dict(zip(names, rows.T, strict=True))
    assert columns["id"].min() == 4 == table.first_path_id
    seen = set()
    for row in range(len(data.train)):
        ids, point_m = data.train.mask(row), points_m(data, row)
        boxes = list(places)
        for at in np.flatnonzero(columns["path"] == data.train.poses.path[row]):
            foot = [columns[f"{axis}_m"][at] for axis in "xyz"]
            size = [columns[f"size_{axis}_m"][at] for axis in "xyz"]
            boxes.append((int(columns["id"][at]), foot, size, columns["yaw_deg"][at]))
        for number, foot, size, yaw in boxes:
            own = ids == number
            assert in_box(point_m[own], foot, size, yaw).all()
            seen |= {number} if own.any() else set()
        assert set(np.unique(ids)) <= {0, 1, *(number for number, *_ in boxes)}
        floor = (ids == 1) & (point_m[..., 2] < -1.49) & (np.abs(point_m[..., 0]) < 2.9)
        floor &= np.abs(point_m[..., 1]) < 2.4
        normal_world = data.train.normals_cam(row) @ data.train.world_from_cam[row, :3, :3].T
        assert np.abs(normal_world[floor] - [0.0, 0.0, 1.0]).max(initial=0.0) < 7e-3
    assert 1 not in seen
    assert len(seen) >= 3


def test_a_data_set_with_layers_is_valid_and_its_layers_are_shown(collected, tmp_path, capsys):
    assert main(["validate", str(collected)]) == 0
    lines = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()[1:]}
    assert " ok " in lines["normals"]
    assert " ok " in lines["masks"]
    out = tmp_path / "layers.gif"
    shown = ["--show", "color", "depth", "normals", "masks", "--frames", "2"]
    assert main(["preview", str(collected), "--out", str(out), *shown]) == 0
    with Image.open(out) as image:
        assert image.size[0] == 4 * 320


def unpacked(collected, folder):
    """A copy whose first sequence is a directory."""
    shutil.copytree(collected, folder)
    shutil.unpack_archive(folder / "seq-01.zip", folder)
    (folder / "seq-01.zip").unlink()
    without_manifest_hashes(folder)
    return folder


def altered(path, change):
    pixels = np.asarray(Image.open(path))
    Image.fromarray(change(pixels)).save(path)


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        ("normal", lambda rgb: rgb[..., [2, 1, 0]], "point away from the camera|degrees off"),
        ("normal", lambda rgb: 0 * rgb + TO_CAMERA, f"degrees off .* bound {MOST_DEG:g}"),
        ("normal", lambda rgb: rgb // 2, "not of length 1"),
        ("normal", lambda rgb: rgb[:5], "is not 40 x 33"),
        (
            "mask",
            lambda ids: ids * np.uint16(0),
            "where there is anything",
        ),
        ("mask", lambda ids: (ids * 0 + 3).astype(np.uint8), "16-bit grey image of ids"),
    ],
)
def test_validate_names_the_damaged_layer(collected, tmp_path, capsys, kind, change, message):
    folder = unpacked(collected, tmp_path / "set")
    altered(folder / "seq-01" / f"frame-000003.{kind}.png", change)
    name = f"frame-000003.{kind}.png"
    assert re.search(f"{name}.*({message})", validation_errors(folder, capsys))


def validation_errors(folder, capsys):
    """The lines that begin with ``error:``."""
    capsys.readouterr()
    assert main(["validate", str(folder)]) == 1
    text = capsys.readouterr().err
    assert "Traceback" not in text
    return "\n".join(line for line in text.splitlines() if line.startswith("error: "))


def test_an_unlisted_instance_a_missing_file_and_a_damaged_table_are_named(
    collected, tmp_path, capsys
):
    folder = unpacked(collected, tmp_path / "set")
    record = json.loads((folder / "masks.json").read_text())
    del record["path_objects"], record["instances"][0]
    (folder / "masks.json").write_text(json.dumps(record))
    errors = validation_errors(folder, capsys)
    assert "shows instance 1, which masks.json does not list" in errors
    (folder / "masks.json").write_text("[]")
    assert "cannot be read as the table of instances" in validation_errors(folder, capsys)
    (folder / "seq-01" / "frame-000002.mask.png").unlink()
    with pytest.raises(InputError, match=r"frame-000002.mask.png: missing"):
        synfeal.open_dataset(folder).train.mask(2)


def test_what_a_data_set_lacks_is_said(tmp_path, capfd):
    room = save_room(tmp_path / "room.glb")
    data = synfeal.collect(room, tmp_path / "set", 2, width=40, height=33, spacing_m=0.2)
    with pytest.raises(InputError, match="normals: the data set has none; collect it with"):
        data.train.normals_cam(0)
    with pytest.raises(InputError, match=r"masks.json: cannot be read"):
        read_instances(tmp_path / "set")
    message = refused(capfd, "preview", tmp_path / "set", "--show", "masks")
    assert "has no masks; collect it with --masks" in message
    for read in (read_mask, read_normals):
        with pytest.raises(InputError, match=r"absent.png"):
            read(tmp_path / "absent.png")


def test_a_renderer_gives_normals_of_any_pose():
    mesh, pose = scene("room")
    with synfeal.Renderer(mesh, width=44, height=33, backend="raycast") as renderer:
        seen = renderer.render_surface(pose)
        depth_m = renderer.render_rgbd(pose)[1]
    np.testing.assert_array_equal(seen.ids > 0, np.isfinite(depth_m))
    floor = inverse(pose)[:3, 2]  # the world's z in the frame of the camera
    rays = pinhole_rays(CAMERA)(np.stack(np.meshgrid(np.arange(44) + 0.5, np.arange(33) + 0.5), -1))
    height_m = (depth_m[..., None] * rays) @ floor + pose[2, 3]
    np.testing.assert_allclose(seen.normals_cam[height_m < 1e-4] @ floor, 1.0, atol=1e-6)
