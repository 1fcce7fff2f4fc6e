"""``synfeal localize --refine``: poses refined on a rendering of the mesh, as a person uses it."""

import csv
import json

import cv2
import numpy as np
import pytest
from PIL import Image

from baselines.references.redrawn import without_light
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.geometry.poses import pose_error, pose_from_quat
from synfeal.mesh.save import save_glb
from synfeal.render.choose import open_renderer
from tests.support.collected import refused, save_room
from tests.support.painted_rooms import write_calibration
from tests.support.small_room import SIZE_M, furnished_room, room_poses

PAINT = (4.0, 12.0, 40.0)
N_PHOTOS = 12
PHOTO = CameraConfig(width=270, height=180, fx=220.0, fy=220.0, cx=131.0, cy=92.0)
POSE = ("tx", "ty", "tz", "qw", "qx", "qy", "qz")


def write_photographs(folder, mesh, poses):
    """What a camera makes of the room: less light, a blur, noise."""
    folder.mkdir()
    rng = np.random.default_rng(5)
    with open_renderer(mesh, PHOTO, RenderConfig()) as renderer:
        for number, pose in enumerate(poses):
            dim = 0.7 * cv2.GaussianBlur(renderer.render(pose), (0, 0), 0.7)
            noisy = dim + rng.normal(0.0, 4.0, dim.shape)
            image = Image.fromarray(noisy.clip(0, 255).astype(np.uint8))
            image.save(folder / f"photo-{number:02d}.png")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A room that was collected and mapped, photographs of it and of another one."""
    folder = tmp_path_factory.mktemp("redrawn")
    room = furnished_room(PAINT)
    save_glb(folder / "room.glb", room)
    write_photographs(folder / "photos", room, room_poses(N_PHOTOS, 2))
    write_photographs(folder / "elsewhere", furnished_room(PAINT, seed=9), room_poses(N_PHOTOS, 2))
    write_calibration(folder / "photo.json", PHOTO)
    inner = np.column_stack([0.3 * SIZE_M, 0.7 * SIZE_M]).ravel()
    collect = ["collect", "--mesh", folder / "room.glb", "--out", folder / "frames", "--depth"]
    size = ["--width", 176, "--height", 132, "--mode", "random"]
    frames = ["--frames", 40, "--box", *inner, "--min-view-distance", 0.5]
    assert main([str(word) for word in (*collect, *size, *frames)]) == 0
    assert main(["map", str(folder / "frames"), "--out", str(folder / "map")]) == 0
    return folder


def localized(place, photos, out, *options):
    """Rows by column, and poses (N, 4, 4), NaN where there is none."""
    command = ["localize", place / "map", place / photos, "--camera", place / "photo.json"]
    assert main([str(word) for word in (*command, "--out", out, *options)]) == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    poses = np.full((len(rows), 4, 4), np.nan)
    for index, row in enumerate(rows):
        if row["status"] == "localized":
            values = [float(row[name]) for name in POSE]
            poses[index] = pose_from_quat(values[:3], values[3:])
    return rows, poses


def test_refined_poses_are_more_exact(place, tmp_path):
    truth = room_poses(N_PHOTOS, 2)
    rows, found = localized(place, "photos", tmp_path / "found.csv")
    again, refined = localized(
        place, "photos", tmp_path / "refined.csv", "--refine", place / "room.glb"
    )
    good = np.isfinite(found).all(axis=(1, 2))
    assert good.sum() > N_PHOTOS / 2
    before, after = (pose_error(poses[good], truth[good]) for poses in (found, refined))
    for measure in (0, 1):
        assert np.median(after[measure]) < np.median(before[measure])
    # Whether a photograph is of the place was settled before.
    for name in ("image", "status", "inliers", "confidence"):
        assert [row[name] for row in again] == [row[name] for row in rows]


def test_photographs_of_another_room_stay_not_localized(place, tmp_path):
    rows, poses = localized(
        place, "elsewhere", tmp_path / "poses.csv", "--refine", place / "room.glb"
    )
    assert {row["status"] for row in rows} == {"not localized"}
    assert np.isnan(poses).all()


def test_another_mesh_is_told_in_one_line(place, tmp_path, capfd):
    """Of another room; of this room in other units."""
    other = save_room(tmp_path / "other.glb")
    camera = ("--camera", place / "photo.json")
    out = tmp_path / "poses.csv"
    line = refused(
        capfd, "localize", place / "map", place / "photos", *camera, "--refine", other, "--out", out
    )
    assert str(other) in line
    assert "% of the features" in line
    assert not out.exists()


def test_the_mesh_is_read_as_its_frames_were(place, tmp_path, capfd):
    """A map of frames that were collected in centimetres is not of a room in metres."""
    record = json.loads((place / "map/map.json").read_text())
    assert record["mesh_file"] == {"up_axis": "auto", "unit_m": 1.0}
    folder = tmp_path / "map"
    folder.mkdir()
    for path in (place / "map").iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    record["mesh_file"]["unit_m"] = 0.01
    (folder / "map.json").write_text(json.dumps(record))
    command = ("localize", folder, place / "photos", "--camera", place / "photo.json")
    refine = ("--refine", place / "room.glb", "--out", tmp_path / "poses.csv")
    assert "% of the features" in refused(capfd, *command, *refine)


def test_grey_values_are_compared_whatever_the_light():
    """Half the exposure and a bright corner change nothing of what is compared."""
    rng = np.random.default_rng(0)
    image = cv2.GaussianBlur(rng.uniform(0, 255, (120, 160)), (0, 0), 2.0)
    image = 128 + 40 * (image - image.mean()) / image.std()
    bright = np.linspace(0.0, 60.0, 160)
    expected = without_light(image.clip(0, 255).astype(np.uint8)).astype(float)
    found = without_light((0.5 * image + bright).clip(0, 255).astype(np.uint8)).astype(float)
    assert np.abs(found - expected).mean() < 0.1 * expected.std()
