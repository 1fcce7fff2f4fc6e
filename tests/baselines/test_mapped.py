"""``synfeal map`` and ``synfeal localize`` with a map, as a person uses them."""

import csv
import json
import shutil

import numpy as np
import pytest
from PIL import Image

from baselines.references.map_frames import FrameChoice
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.world import write_sequence_from_world
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, pose_from_quat, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from tests.support.collected import refused, tree_of
from tests.support.painted_rooms import (
    FRAME,
    PHOTO,
    looking_about,
    textures,
    write_calibration,
    write_dataset,
    write_frames,
    write_photographs,
)

N_FRAMES, N_PHOTOS = 20, 6
# What a pixel of the map's frames covers on the far wall, 4 m away: a pose found from many features
# is off by less than one of them.
FAR_WALL_M = 4.0
PIXEL_M = FAR_WALL_M / FRAME.intrinsics.fx
SEQUENCE_FROM_WORLD = pose_matrix(rotation_from_rpy([0.4, -0.3, 1.2]), [5.0, -2.0, 0.7])


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A mapped room, photographs of it and of another room, and the camera of both."""
    folder = tmp_path_factory.mktemp("place")
    paint = textures(0)
    write_dataset(folder / "frames", paint, looking_about(N_FRAMES, 1))
    write_sequence_from_world(folder / "frames", SEQUENCE_FROM_WORLD)
    write_photographs(folder / "photos", paint, looking_about(N_PHOTOS, 2))
    write_photographs(folder / "elsewhere", textures(7), looking_about(N_PHOTOS, 2))
    write_calibration(folder / "photo.json", PHOTO)
    assert main(["map", str(folder / "frames"), "--out", str(folder / "map")]) == 0
    return folder


def localized(place, images, out, *options, map_="map", camera="photo.json"):
    """Rows by column, and poses (N, 4, 4), NaN where there is none."""
    calibration = ["--camera", str(place / camera)] if camera else []
    command = ["localize", str(place / map_), str(images), "--out", str(out)]
    out.unlink(missing_ok=True)
    assert main([*command, *calibration, *options]) == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    cells = [[float(row[name] or "nan") for name in POSE] for row in rows]
    poses = np.full((len(rows), 4, 4), np.nan)
    for index, values in enumerate(cells):
        if np.isfinite(values).all():
            poses[index] = pose_from_quat(values[:3], values[3:])
    return rows, poses


POSE = ("tx", "ty", "tz", "qw", "qx", "qy", "qz")


def test_photographs_are_found_to_a_pixel_of_the_map(place, tmp_path, capsys):
    rows, poses = localized(place, place / "photos", tmp_path / "poses.csv", "--world", "mesh")
    assert [row["status"] for row in rows] == ["localized"] * N_PHOTOS
    assert [row["image"] for row in rows] == sorted(row["image"] for row in rows)
    position_m, angle_rad = pose_error(poses, looking_about(N_PHOTOS, 2))
    assert np.median(position_m) < PIXEL_M
    assert position_m.max() < 3 * PIXEL_M
    assert np.degrees(angle_rad).max() < 1.0
    assert min(float(row["confidence"]) for row in rows) > 0.999
    assert f"{N_PHOTOS} of {N_PHOTOS} photographs localized in the world of the mesh" in (
        capsys.readouterr().out
    )


def test_poses_come_in_the_world_of_the_sequence(place, tmp_path):
    _, in_mesh = localized(place, place / "photos", tmp_path / "mesh.csv", "--world", "mesh")
    _, in_sequence = localized(place, place / "photos", tmp_path / "sequence.csv")
    np.testing.assert_allclose(in_sequence, SEQUENCE_FROM_WORLD @ in_mesh, atol=1e-5)


def test_photographs_of_another_room_are_not_localized(place, tmp_path, capsys):
    rows, poses = localized(place, place / "elsewhere", tmp_path / "poses.csv")
    assert [row["status"] for row in rows] == ["not localized"] * N_PHOTOS
    assert all(row[name] == "" for row in rows for name in POSE)
    assert np.isnan(poses).all()
    assert max(float(row["confidence"]) for row in rows) < 0.5
    said = capsys.readouterr()
    assert f"0 of {N_PHOTOS} photographs localized" in said.out


def test_a_photograph_that_exif_turns_is_found_with_the_calibration_of_the_sensor(
    place, tmp_path, capsys
):
    """Held upright or upside down, the sensor stores what it sees; the pose is of the upright."""
    truth, half, quarter = looking_about(3, 2), np.diag([-1.0, -1.0, 1.0, 1.0]), np.eye(4)
    quarter[:2, :2] = [[0, -1], [1, 0]]  # the stored x is down in the upright photograph
    held = [truth[0] @ quarter, truth[1] @ half, truth[2]]
    write_photographs(tmp_path / "photos", textures(0), held)
    for number, orientation in enumerate((6, 3, 1)):
        exif = Image.Exif()
        exif[0x0112] = orientation
        path = tmp_path / f"photos/photo-{number:02d}.png"
        with Image.open(path) as image:
            image.load()
        image.save(path, exif=exif)
    rows, poses = localized(place, tmp_path / "photos", tmp_path / "poses.csv", "--world", "mesh")
    assert [row["status"] for row in rows] == ["localized"] * 3
    position_m, angle_rad = pose_error(poses, truth)
    assert position_m.max() < 3 * PIXEL_M
    assert np.degrees(angle_rad).max() < 1.0
    assert "2 of them stand upright by their EXIF" in capsys.readouterr().out


def test_a_picture_without_anything_on_it_is_not_localized(place, tmp_path):
    blank = tmp_path / "blank.png"
    Image.new("L", (PHOTO.width, PHOTO.height), 90).save(blank)
    rows, _ = localized(place, blank, tmp_path / "poses.csv")
    assert [(row["status"], row["inliers"]) for row in rows] == [("not localized", "0")]


def test_one_picture_gets_the_pose_it_gets_among_others(place, tmp_path):
    one = place / "photos/photo-03.png"
    rows, _ = localized(place, one, tmp_path / "one.csv")
    every, _ = localized(place, place / "photos", tmp_path / "all.csv")
    assert rows == [every[3]]


def test_a_lens_that_bends_lines_is_allowed_for(place, tmp_path):
    lens = (-0.25, 0.08, 0.002, -0.001, 0.0)
    truth = looking_about(4, 5)
    write_photographs(tmp_path / "photos", textures(0), truth, lens=lens)
    known = write_calibration(tmp_path / "lens.json", PHOTO, lens)
    world = ("--world", "mesh")
    _, poses = localized(
        place, tmp_path / "photos", tmp_path / "poses.csv", *world, camera=str(known)
    )
    assert np.median(pose_error(poses, truth)[0]) < PIXEL_M
    _, unaware = localized(place, tmp_path / "photos", tmp_path / "unaware.csv", *world)
    off_m = np.nan_to_num(pose_error(unaware, truth)[0], nan=np.inf)
    assert np.median(off_m) > 2 * PIXEL_M


@pytest.mark.parametrize("factor", [0.85, 1.15])
def test_a_wrong_focal_length_is_seen(place, tmp_path, caplog, factor):
    wrong = {name: factor * getattr(PHOTO, name) for name in ("fx", "fy")}
    file = write_calibration(tmp_path / "wrong.json", PHOTO.model_copy(update=wrong))
    localized(place, place / "photos", tmp_path / "poses.csv", camera=str(file))
    said = [record.getMessage() for record in caplog.records if "focal length" in record.message]
    assert len(said) == 1
    if "times" in said[0]:
        ratio = float(said[0].split(" times")[0].split()[-1])
        assert ratio == pytest.approx(1 / factor, rel=0.04)


def test_the_right_focal_length_is_not_doubted(place, tmp_path, caplog):
    localized(place, place / "photos", tmp_path / "poses.csv")
    # Of 20 frames no map can state an error, which is said.
    assert [record.msg for record in caplog.records if "state no error" not in record.msg] == []


def test_exif_tells_the_focal_length(place, tmp_path):
    """35 mm film has a diagonal of 43.27 mm; the photographs are of a centred camera here."""
    camera = CameraConfig(width=270, height=180, fx=247.5, fy=247.5, cx=135.0, cy=90.0)
    truth = looking_about(3, 9)
    write_photographs(tmp_path / "photos", textures(0), truth, camera)
    film_mm = round(247.5 * np.hypot(36.0, 24.0) / np.hypot(270, 180))  # EXIF holds whole ones
    for path in list((tmp_path / "photos").iterdir()):
        image = Image.open(path)
        exif = Image.Exif()
        exif.get_ifd(0x8769)[0xA405] = film_mm
        image.save(path.with_suffix(".jpg"), exif=exif, quality=95)
        path.unlink()
    _, poses = localized(
        place, tmp_path / "photos", tmp_path / "poses.csv", "--world", "mesh", camera=None
    )
    # 33 mm in place of 33.00 is right to a percent, and so is the distance to the wall.
    assert np.median(pose_error(poses, truth)[0]) < 0.02 * FAR_WALL_M


def test_without_a_focal_length_nothing_is_guessed(place, tmp_path, capsys):
    out = tmp_path / "poses.csv"
    line = refused(capsys, "localize", place / "map", place / "photos", "--out", out)
    assert "photo-00.png" in line
    assert "--focal" in line
    assert not out.exists()


def test_photographs_with_depth_make_a_map_too(tmp_path, capsys):
    """Depth from a camera beside the colour camera, with another lens and in other units."""
    paint, poses, truth = textures(0), looking_about(N_FRAMES, 1), looking_about(4, 2)
    depth_camera = CameraConfig(width=200, height=160, fx=190.0, fy=190.0, cx=104.0, cy=77.0)
    beside = [0.5, -2.0, 1.0, 0.08, -0.02, 0.03]  # degrees, metres
    depth_from_color = pose_matrix(rotation_from_vector(np.radians(beside[:3])), beside[3:])
    sequence = tmp_path / "sequence"
    write_frames(sequence, paint, poses, FRAME, depth_camera, depth_from_color)
    write_photographs(tmp_path / "photos", paint, truth)
    color = write_calibration(tmp_path / "color.json", FRAME)
    depth = write_calibration(tmp_path / "depth.json", depth_camera)
    write_calibration(tmp_path / "photo.json", PHOTO)
    command = ["map", str(sequence), "--color-camera", str(color), "--depth-camera", str(depth)]
    aside = ["--depth-from-color", *map(str, beside)]
    assert main([*command, *aside, "--out", str(tmp_path / "right")]) == 0
    assert main([*command, "--out", str(tmp_path / "wrong")]) == 0
    errors = {}
    for name in ("right", "wrong"):
        out = tmp_path / f"{name}.csv"
        _, found = localized(tmp_path, tmp_path / "photos", out, map_=name)
        errors[name] = np.median(np.nan_to_num(pose_error(found, truth)[0], nan=np.inf))
    assert errors["right"] < PIXEL_M
    assert errors["wrong"] > 2 * errors["right"]
    # More photographs of the camera that took those of the map need nothing else.
    write_photographs(tmp_path / "more", paint, truth, FRAME)
    _, found = localized(
        tmp_path, tmp_path / "more", tmp_path / "more.csv", "--no-exif", map_="right", camera=None
    )
    assert np.median(pose_error(found, truth)[0]) < PIXEL_M
    # Photographs of other proportions are of another one.
    line = refused(
        capsys, "localize", tmp_path / "right", tmp_path / "photos", "--out", tmp_path / "x.csv"
    )
    assert "photo-00.png" in line
    assert "--focal" in line


def rotation_from_vector(vector):
    """Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def test_the_same_frames_make_the_same_map(place, tmp_path):
    assert main(["map", str(place / "frames"), "--out", str(tmp_path / "map")]) == 0
    found, expected = tree_of(tmp_path / "map"), tree_of(place / "map")
    for files in (found, expected):
        del files["map.json"]  # has the time
        del files["trial.json"]  # names map.json by its hash
    assert found == expected
    trials = [json.loads((folder / "map/trial.json").read_text()) for folder in (tmp_path, place)]
    for trial in trials:
        del trial["map_sha256"]
    assert trials[0] == trials[1]


def test_a_map_is_plain_files_with_their_origin(place):
    record = json.loads((place / "map/map.json").read_text())
    assert (record["format"], record["version"]) == ("synfeal map", 1)
    assert record["frames"] == N_FRAMES
    assert record["provenance"]["packages"]["numpy"] == np.__version__
    assert {path.suffix for path in (place / "map").iterdir()} == {".json", ".csv", ".npz"}
    for path in (place / "map").glob("*.npz"):
        with np.load(path, allow_pickle=False) as arrays:
            assert all(arrays[name].dtype != object for name in arrays)


def edited(change):
    """A change of ``map.json``."""

    def apply(folder):
        path = folder / "map.json"
        record = json.loads(path.read_text())
        change(record)
        path.write_text(json.dumps(record))

    return apply


def cut(name):
    def apply(folder):
        path = folder / name
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    return apply


def fewer_frames(folder):
    path = folder / "frames.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))


DAMAGE = {
    "map.json": lambda folder: (folder / "map.json").unlink(),
    "features.npz": lambda folder: (folder / "features.npz").unlink(),
    "retrieval.npz": cut("retrieval.npz"),
    "features.npz: cannot": cut("features.npz"),
    "features.npz: is not of": fewer_frames,
    "version": edited(lambda record: record.update(version=99)),
    "format": edited(lambda record: record.update(format="something")),
    "camera": edited(lambda record: record["camera"].update(fx=-5.0)),
    "sequence_from_world": edited(lambda record: record.update(sequence_from_world=[[2, 0], [0]])),
    "map.json: cannot": lambda folder: (folder / "map.json").write_text("[1, 2"),
}


@pytest.mark.parametrize("names", DAMAGE)
def test_a_damaged_map_is_told_in_one_line(place, tmp_path, capsys, names):
    shutil.copytree(place / "map", tmp_path / "map")
    DAMAGE[names](tmp_path / "map")
    out = tmp_path / "poses.csv"
    photos, camera = place / "photos", ("--camera", place / "photo.json")
    line = refused(capsys, "localize", tmp_path / "map", photos, *camera, "--out", out)
    assert names in line
    assert str(tmp_path / "map") in line
    assert not out.exists()


def test_what_cannot_be_mapped_is_told_in_one_line(place, tmp_path, capsys):
    shutil.copytree(place / "frames", tmp_path / "flat")
    for path in (tmp_path / "flat/seq-01").glob("*.depth.png"):
        path.unlink()
    out = tmp_path / "map"
    assert "--depth" in refused(capsys, "map", tmp_path / "flat", "--out", out)
    (tmp_path / "empty").mkdir()
    assert str(tmp_path / "empty") in refused(capsys, "map", tmp_path / "empty", "--out", out)
    few = ("--range", "90", "99")
    assert "--range" in refused(capsys, "map", place / "frames", *few, "--out", out)
    assert "--stride" in refused(capsys, "map", place / "frames", "--stride", "0", "--out", out)
    assert str(place / "map") in refused(
        capsys, "map", place / "frames", "--out", place / "map"
    )  # holds a map
    nothing = refused(capsys, "map", place / "frames/seq-01", "--out", out)
    assert "--preset" in nothing  # nothing says what took them
    assert not out.exists()


def test_frames_without_texture_make_no_map(tmp_path, capsys):
    write_dataset(tmp_path / "frames", textures(0), looking_about(3, 1))
    grey = np.full((FRAME.height, FRAME.width, 3), 128, np.uint8)
    for path in (tmp_path / "frames/seq-01").glob("*.color.png"):
        path.write_bytes(encode_png(grey))
    line = refused(capsys, "map", tmp_path / "frames", "--out", tmp_path / "map")
    assert "texture" in line
    assert not (tmp_path / "map").exists()


def test_an_empty_folder_of_photographs_is_told_in_one_line(place, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    focal = ("--focal", "300")
    line = refused(capsys, "localize", place / "map", tmp_path / "empty", *focal)
    assert str(tmp_path / "empty") in line


def test_nothing_but_poses_is_overwritten(place, capsys):
    photo = place / "photos/photo-00.png"
    before = photo.read_bytes()
    options = ("--camera", place / "photo.json", "--out", photo)
    refused(capsys, "localize", place / "map", place / "photos", *options)
    assert photo.read_bytes() == before


def test_poses_left_out_are_errors_to_evaluate(place, tmp_path, capsys):
    """Two photographs are of another room, and so two frames have no pose."""
    truth = looking_about(N_PHOTOS, 2)
    dataset = tmp_path / "dataset"
    write_dataset(dataset, textures(0), truth)
    for number in (2, 5):
        name = f"frame-{number:06d}.color.png"
        image = Image.open(place / f"elsewhere/photo-{number:02d}.png").resize(
            (FRAME.width, FRAME.height)
        )
        image.save(dataset / "seq-01" / name)
    (tmp_path / "frame.json").write_text((dataset / "manifest.json").read_text())
    out = tmp_path / "poses.csv"
    localized(place, dataset / "seq-01", out, "--world", "mesh", camera=tmp_path / "frame.json")
    scores = tmp_path / "scores"
    command = ["evaluate", str(dataset), str(out), "--split", "train", "--out", str(scores)]
    assert main(command) == 0
    with (scores / "errors.csv").open(newline="") as file:
        errors = [float(row["position_m"] or "inf") for row in csv.DictReader(file)]
    assert [index for index, error in enumerate(errors) if not np.isfinite(error)] == [2, 5]


def test_frames_are_chosen_by_range_stride_and_number():
    assert FrameChoice().rows(5).tolist() == [0, 1, 2, 3, 4]
    assert FrameChoice(every=2).rows(5).tolist() == [0, 2, 4]
    spread = FrameChoice(most=4).rows(100)
    assert (spread[0], spread[-1], len(spread)) == (0, 99, 4)
    assert np.ptp(np.diff(spread)) <= 1
    with pytest.raises(InputError, match="range: "):
        FrameChoice(start=5, stop=5)
