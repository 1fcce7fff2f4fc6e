"""``synfeal localize --refine``: poses refined on a rendering of the mesh, as a person uses it.

Its parts, against images and motions that are known.
"""

import csv
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image

from baselines.references.confidence import NO_SUPPORT
from baselines.references.mapped import read_map
from baselines.references.photographs import Answer, Finder, Photograph
from baselines.references.redrawn import Redrawn, mesh_from_map, read_redrawn, without_light
from synfeal.camera.calibration import Calibration
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.world import KEY
from synfeal.geometry.poses import inverse, pose_error, pose_from_quat, pose_matrix
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.records.files import write_json
from synfeal.render.choose import open_renderer
from tests.support.collected import refused, save_room
from tests.support.painted_rooms import write_calibration
from tests.support.small_room import SIZE_M, furnished_room, paint, room_poses

PAINT = (4.0, 12.0, 40.0)
N_PHOTOS = 12
PHOTO = CameraConfig(width=270, height=180, fx=220.0, fy=220.0, cx=131.0, cy=92.0)
POSE = ("tx", "ty", "tz", "qw", "qx", "qy", "qz")


def write_photographs(folder, mesh, poses):
    """Photograph the room as a camera does: less light, a blur, noise."""
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
    collect = ["collect", folder / "room.glb", "--out", folder / "frames", "--depth"]
    size = ["--width", 176, "--height", 132, "--mode", "random"]
    frames = ["--frames", 40, "--box", *inner, "--min-view-distance", 0.5]
    assert main([str(word) for word in (*collect, *size, *frames)]) == 0
    assert main(["map", str(folder / "frames"), "--out", str(folder / "map")]) == 0
    return folder


def localized(place, photos, out, *options):
    """Rows by column, and poses (N, 4, 4), NaN where there is none."""
    command = ["localize", place / "map", place / photos, "--camera", place / "photo.json"]
    out.unlink(missing_ok=True)
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
    """Refuse a mesh of another room, and of this room in other units."""
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


@pytest.fixture(scope="module")
def opened(place):
    """The mapped room, to refine poses in."""
    with Redrawn(read_map(place / "map"), furnished_room(PAINT), np.eye(4)) as redrawn:
        yield redrawn


@pytest.fixture(scope="module")
def camera(place):
    """The camera of the map's frames."""
    return read_map(place / "map").camera


def turned(degrees, axis=(0.0, 0.0, 1.0), shift_m=(0.0, 0.0, 0.0)):
    """A turn about an axis of unit length, followed by a shift."""
    half = np.radians(degrees) / 2
    return pose_from_quat(shift_m, [np.cos(half), *np.sin(half) * np.asarray(axis)])


def moved(mesh, motion, scale=1.0):
    """A mesh whose vertices went through a motion, after they were scaled about its middle."""
    middle_m = SIZE_M / 2
    parts = []
    for part in mesh.parts:
        corner_m = middle_m + scale * (part.vertices_m - middle_m)
        parts.append(replace(part, vertices_m=corner_m @ motion[:3, :3].T + motion[:3, 3]))
    return TexturedMesh(tuple(parts))


def seen_from(pose, camera):
    """Grey values (H, W) of the room."""
    with open_renderer(furnished_room(PAINT), camera, RenderConfig()) as renderer:
        return cv2.cvtColor(renderer.render(pose), cv2.COLOR_RGB2GRAY)


def photograph_of(grey):
    """A photograph that shows nothing but these grey values (H, W), to the camera of the map."""
    nothing = np.zeros((0, 2)), np.zeros((0, 128), np.float32), np.zeros((64, 64, 3), np.uint8)
    return Photograph(*nothing, grey, np.ones(grey.shape, bool))


def answer_at(pose):
    return Answer(pose, NO_SUPPORT, 1.0)


SLIGHTLY_OFF = turned(1.5, np.array([1.0, 2.0, 2.0]) / 3, (0.03, -0.02, 0.02))


def test_a_photograph_from_the_very_pose_leaves_it_there(opened, camera):
    """Nothing moves in the picture, so half a pixel would be an error of 0.2 degrees."""
    for pose in room_poses(3, 4):
        refined = opened.refine(photograph_of(seen_from(pose, camera)), answer_at(pose))
        position_m, angle_rad = pose_error(refined.world_from_cam, pose)
        assert position_m < 1e-4
        assert np.degrees(angle_rad) < 1e-2


def test_a_picture_of_noise_changes_no_pose(opened, camera):
    """Even of noise some places seem to come back, and some pose agrees with a few of them."""
    pose = room_poses(N_PHOTOS, 2)[7]
    answer = answer_at(pose @ SLIGHTLY_OFF)
    size = (camera.height, camera.width)
    for seed in range(4):
        noise = np.random.default_rng(seed).integers(0, 256, size).astype(np.uint8)
        refined = opened.refine(photograph_of(noise), answer)
        np.testing.assert_array_equal(refined.world_from_cam, answer.world_from_cam)
    rightly = opened.refine(photograph_of(seen_from(pose, camera)), answer).world_from_cam
    before, after = (pose_error(each, pose) for each in (answer.world_from_cam, rightly))
    assert after[0] < 0.5 * before[0]


def test_a_photograph_is_refined_on_the_part_of_the_picture_that_it_shows(opened, place):
    """A third, up and to the right: what lies beyond it speaks neither for nor against a pose."""
    narrow = CameraConfig(width=270, height=180, fx=400.0, fy=400.0, cx=60.0, cy=150.0)
    calibration = Calibration(270, 180, 400.0, 400.0, 60.0, 150.0, (0.0,) * 5)
    finder, poses = Finder(read_map(place / "map")), room_poses(N_PHOTOS, 2)
    found = []
    with open_renderer(furnished_room(PAINT), narrow, RenderConfig()) as renderer:
        for pose in poses:
            photograph = finder.look_at(Image.fromarray(renderer.render(pose)), calibration)
            assert 0.2 < photograph.shown.mean() < 0.4
            found.append(opened.refine(photograph, answer_at(pose @ SLIGHTLY_OFF)).world_from_cam)
    before, after = (pose_error(each, poses) for each in (poses @ SLIGHTLY_OFF, np.stack(found)))
    for measure in (0, 1):
        assert (after[measure] < before[measure]).all()
        assert np.median(after[measure]) < 0.5 * np.median(before[measure])


def grid_of(camera):
    """All places of a picture (H W, 2)."""
    return np.indices((camera.height, camera.width))[::-1].reshape(2, -1).T


def check_followed(opened, camera, images, arrive):
    """Whether places are followed to where they truly go, those that stay inside and no others."""
    every = grid_of(camera)
    last = np.array([camera.width, camera.height]) - 1
    place, arrived = opened._followed(*images, every)
    assert (arrived >= 0).all()
    assert (arrived <= last).all()
    missed_px = np.linalg.norm(arrived - arrive(place), axis=1)
    assert np.median(missed_px) < 0.5
    assert (missed_px < 2).mean() > 0.95
    there = arrive(every)
    inside = every[((there > 3) & (there < last - 3)).all(axis=1)]
    outside = every[((there < -3) | (there > last + 3)).any(axis=1)]
    kept = {tuple(each) for each in place.tolist()}
    assert len(outside) > 100
    assert not kept & {tuple(each) for each in outside.tolist()}
    assert len(kept & {tuple(each) for each in inside.tolist()}) > 0.95 * len(inside)


@pytest.mark.parametrize("shift_px", [(9, 6), (-9, 6), (-9, -6)])
def test_places_are_followed_by_the_shift_of_a_picture_unless_they_leave_it(
    opened, camera, shift_px
):
    """Places that leave to one side would be looked up at the other one."""
    x, y = shift_px
    image = paint(np.random.default_rng(6), PAINT)[..., 0]
    middle = np.s_[100 : 100 + camera.height, 100 : 100 + camera.width]
    images = image[middle], np.roll(image, (y, x), axis=(0, 1))[middle]
    check_followed(opened, camera, images, lambda place: place + shift_px)


def test_places_are_followed_outwards_where_the_camera_comes_nearer(opened, camera):
    """The way back begins where the way there ends, and is not the same as where that began."""
    image = paint(np.random.default_rng(7), PAINT)[: camera.height, : camera.width, 0]
    middle, nearer = np.array([80.0, 70.0]), 1.15
    column, row = (middle + (grid_of(camera) - middle) / nearer).astype(np.float32).T
    looks = (each.reshape(image.shape) for each in (column, row))
    larger = cv2.remap(image, *looks, cv2.INTER_CUBIC)

    def arrive(place):
        return middle + nearer * (place - middle)

    check_followed(opened, camera, (image, larger), arrive)


# By hand: a quarter turn about z, then a shift; and a quarter turn about x, then a shift.
SEQUENCE_FROM_MESH = pose_matrix(
    np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([1.0, 2, 3])
)
SEQUENCE_FROM_MAP = pose_matrix(
    np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0.0, 0, 5])
)


def scan_file(folder, sequence_from_mesh):
    """Where a mesh would be, beside the record of its scan."""
    write_json(folder / "scan.json", {KEY: sequence_from_mesh.tolist()})
    return folder / "scan.glb"


def test_the_worlds_of_map_and_scan_meet_in_that_of_their_sequence(place, tmp_path):
    shown = replace(read_map(place / "map"), sequence_from_world=SEQUENCE_FROM_MAP)
    motion = mesh_from_map(shown, scan_file(tmp_path, SEQUENCE_FROM_MESH))
    # (1, 2, 3) of the map is (1, -3, 2 + 5) of the sequence, and that (-3 - 2, 1 - 1, 7 - 3) of the
    # mesh: x and y are turned back, (x, y) = (y' - 2, 1 - x').
    np.testing.assert_allclose(motion @ [1, 2, 3, 1], [-5, 0, 4, 1], atol=1e-12)
    np.testing.assert_allclose(motion @ [0, 0, 0, 1], [-2, 1, 2, 1], atol=1e-12)
    for point in np.eye(4):
        there = SEQUENCE_FROM_MESH @ motion @ point
        np.testing.assert_allclose(there, SEQUENCE_FROM_MAP @ point, atol=1e-12)


def test_a_mesh_or_a_map_of_no_sequence_is_in_the_world_of_the_other(place, tmp_path):
    shown = read_map(place / "map")
    assert shown.sequence_from_world is None
    np.testing.assert_array_equal(
        mesh_from_map(shown, scan_file(tmp_path, SEQUENCE_FROM_MESH)), np.eye(4)
    )
    of_sequence = replace(shown, sequence_from_world=SEQUENCE_FROM_MAP)
    np.testing.assert_array_equal(mesh_from_map(of_sequence, place / "room.glb"), np.eye(4))


def test_a_scan_that_stands_elsewhere_is_found_by_its_record(place, tmp_path, camera):
    """Poses are in the world of the map, whichever world the mesh is in."""
    mesh_from_map = inverse(SEQUENCE_FROM_MESH) @ SEQUENCE_FROM_MAP
    file = scan_file(tmp_path, SEQUENCE_FROM_MESH)
    save_glb(file, moved(furnished_room(PAINT), mesh_from_map))
    shown = replace(read_map(place / "map"), sequence_from_world=SEQUENCE_FROM_MAP)
    (pose,) = room_poses(1, 4)
    with read_redrawn(shown, file, place / "map") as redrawn:
        assert redrawn.share_on_mesh() > 0.99
        photograph = photograph_of(seen_from(pose, camera))
        refined = redrawn.refine(photograph, answer_at(pose @ SLIGHTLY_OFF)).world_from_cam
    before, after = (pose_error(each, pose) for each in (pose @ SLIGHTLY_OFF, refined))
    assert after[0] < 0.5 * before[0]
    assert after[1] < 0.5 * before[1]


@pytest.mark.parametrize(
    ("motion", "scale", "least", "most"),
    [
        (np.eye(4), 1.0, 0.99, 1.0),
        (turned(0.0, shift_m=(30.0, 0.0, 0.0)), 1.0, 0.0, 0.0),  # the room is 5 m long
        (turned(90.0, shift_m=(4.5, -0.5, 0.0)), 1.0, 0.0, 0.4),  # about its middle
        (np.eye(4), 1.4, 0.0, 0.02),  # everything is farther
        (np.eye(4), 0.75, 0.0, 0.02),  # everything is nearer
    ],
)
def test_features_lie_on_the_mesh_that_they_are_of_and_on_no_other(
    place, motion, scale, least, most
):
    mesh = moved(furnished_room(PAINT), np.eye(4), scale)
    with Redrawn(read_map(place / "map"), mesh, motion) as redrawn:
        assert least <= redrawn.share_on_mesh() <= most
