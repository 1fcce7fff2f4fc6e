"""From a capture to located photographs in two commands, each without an option that matters."""

from __future__ import annotations

import json
import logging
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import ExifTags, Image

from baselines import api
from baselines.places import choices
from baselines.places.build import tell_of_network
from baselines.places.choices import choose
from baselines.places.place import Place, open_map
from baselines.places.report import plan_of
from synfeal.camera.photograph import PhotographCamera
from synfeal.cli import main
from synfeal.config.collection import AROUND_M
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.geometry.poses import pose_error, pose_from_quat, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.save import save_glb
from synfeal.records.files import unfinished_prefix
from synfeal.records.lock import only_command
from synfeal.render.choose import open_renderer
from tests.support.capture_writers import HEIGHT, WIDTH, Y_UP_FROM_ROOM, camera, scanner_app
from tests.support.small_room import SIZE_M, furnished_room

pytest.importorskip("open3d")
BUILD = ("--frames", "50", "--width", "240")
N_STAGES = 6


@pytest.fixture(scope="module")
def capture(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("capture") / "All_Data"
    scanner_app(folder)
    return folder


@pytest.fixture(scope="module")
def place(capture, tmp_path_factory) -> Path:
    """Of coarse voxels, which take a quarter of the time."""
    out = tmp_path_factory.mktemp("place") / "room"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(choices, "FINE_M", 0.035)
        patch.setattr(choices, "COARSE_M", 0.035)
        assert main(["build", str(capture), "--out", str(out), *BUILD]) == 0
    return out


def room_from_cam():
    """Poses (N, 4, 4) between those of the capture."""
    rng = np.random.default_rng(11)
    return np.stack(
        [
            pose_matrix(
                rotation_from_rpy([*rng.uniform([-0.1, 0.0], [0.1, 0.3]), yaw]),
                SIZE_M * [0.5, 0.45, 0.6] + rng.uniform(-0.3, 0.3, 3) * [1.0, 1.0, 0.5],
            )
            for yaw in np.linspace(0.2, 6.0, 8)
        ]
    )


def localized(file: Path):
    """Return which photographs (N) were localized, and the poses of those."""
    table = pd.read_csv(file)
    found = (table["status"] == "localized").to_numpy()
    values = table.loc[found, ["tx", "ty", "tz", "qw", "qx", "qy", "qz"]].to_numpy(float)
    return found, pose_from_quat(values[:, :3], values[:, 3:])


def test_photographs_are_localized_in_the_world_of_the_capture(place, tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    room = furnished_room((4.0, 12.0, 40.0))
    with open_renderer(room, camera(WIDTH, HEIGHT), RenderConfig()) as renderer:
        for number, pose in enumerate(room_from_cam()):
            Image.fromarray(renderer.render(pose)).save(photos / f"{number}.png")
    out = tmp_path / "poses.csv"
    assert main(["localize", str(place), str(photos), "--out", str(out)]) == 0
    found, answers = localized(out)
    assert found.mean() >= 0.75
    error_m, error_rad = pose_error(answers, (Y_UP_FROM_ROOM @ room_from_cam())[found])
    assert np.median(error_m) < 0.05
    assert np.median(np.degrees(error_rad)) < 1.0


def test_the_report_says_what_was_measured(place):
    record = json.loads((place / "place.json").read_text())
    check = record["check"]
    assert record["finished"]
    assert (check["kind"], check["pictures"]) == ("fused photographs", 40)
    assert check["position_m"] < 0.05
    assert record["cameras"] == {"mode": "around", "around_m": AROUND_M}
    page = (place / "report.html").read_text()
    assert "within 0.5 m of the capture's own" in page
    assert f"{check['localized']} of 40 photographs" in page
    assert f"{100 * check['position_m']:.1f} cm" in page
    assert page.count("<circle") == 40
    assert "data:image/jpeg;base64" in page
    assert "sensed by the device" in page
    assert "<dt>noted</dt><dd>40 of 80 frames have no photograph" in page


def test_the_report_plots_stated_errors(place):
    """Of photographs of known pose, and of the frames that the map was tried on, if enough."""
    record = json.loads((place / "place.json").read_text())
    levels = {one["level"]: one["held"] for one in record["check"]["stated"]["position_m"]}
    table = pd.read_csv(place / "check.csv")
    assert table.loc[table["status"] == "localized", "position_95_m"].gt(0).all()
    assert 0.8 <= levels[0.95] <= levels[0.99] <= 1.0
    assert record["trial"]["localized"] <= record["trial"]["pictures"] == 50
    trial = json.loads((place / "map/trial.json").read_text())
    assert len(trial["photographs"]["position_m"]) == record["check"]["localized"]
    page = (place / "report.html").read_text()
    plotted = [of for of in ("trial", "check") if record[of]["stated"]]
    assert page.count("<polyline") == 2 * len(plotted)
    assert page.count('<polyline class="check') == 2
    assert "said to be within the radius" in page
    usual_m = table.loc[table["status"] == "localized", "position_95_m"].median()
    assert record["trial"]["usual_95_m"] >= usual_m * 0.99  # photographs widen, they do not narrow
    assert f"is {100 * record['trial']['usual_95_m']:.1f} cm, median of the photographs" in page


def test_built_again_nothing_is_made_anew(place, capture, capsys):
    before = {path: path.stat().st_mtime_ns for path in place.rglob("*.glb")}
    assert main(["build", str(capture), "--out", str(place), *BUILD]) == 0
    assert {path: path.stat().st_mtime_ns for path in place.rglob("*.glb")} == before
    assert capsys.readouterr().out.count("was there") == N_STAGES


def test_two_builds_do_not_work_in_one_folder(place, capture, capsys):
    of_nobody = f"-{2**22 + 1}-"  # above the largest number of a process
    left = place / f"{unfinished_prefix('scan').replace(f'-{os.getpid()}-', of_nobody)}killed"
    left.mkdir()
    with only_command(place, place / ".lock"):
        assert main(["build", str(capture), "--out", str(place), *BUILD]) == 1
    assert "another run is at work there" in capsys.readouterr().err
    assert main(["build", str(capture), "--out", str(place), *BUILD]) == 0
    assert not left.exists()
    assert not (place / ".lock").exists()


def test_a_place_goes_on_where_it_was_moved_to(place, capture, tmp_path, capsys):
    copy = Path(shutil.copytree(place, tmp_path / "copy"))
    (copy / "report.html").unlink()
    assert main(["build", str(capture), "--out", str(copy), *BUILD]) == 0
    assert capsys.readouterr().out.count("was there") == N_STAGES
    assert (copy / "report.html").read_text().count("<circle") == 40
    (copy / "check.csv").write_text((copy / "check.csv").read_text().replace("-000003", "-999999"))
    assert main(["build", str(capture), "--out", str(copy), *BUILD]) == 1
    assert "names frames/frame-999999.color" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--frames", "0"], "--frames: must be at least 1"),
        (["--frames", "90"], "is of frames 50, asked for is 90"),
        (["--format", "colmap"], "is of source"),
    ],
)
def test_another_build_into_the_folder_is_refused(options, said, place, capture, capsys):
    words = ["build", str(capture), "--out", str(place), *BUILD, *options]
    assert main(words) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_a_folder_of_somebody_else_is_left_alone(capture, tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["build", str(capture), "--out", str(tmp_path)]) == 1
    assert "is no place and not empty" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_capture_without_depth_is_refused_before_anything_is_written(capture, tmp_path, capsys):
    bare = tmp_path / "bare"
    shutil.copytree(capture, bare, ignore=shutil.ignore_patterns("depth_*", "conf_*"))
    assert main(["build", str(bare), "--out", str(tmp_path / "place")]) == 1
    said = capsys.readouterr().err
    assert "has no depth, of which a scan is made" in said
    assert "synfeal map" in said
    assert not (tmp_path / "place").exists()


def test_without_open3d_a_capture_is_refused_before_anything_is_written(
    capture, tmp_path, capsys, monkeypatch
):
    monkeypatch.setitem(sys.modules, "open3d", None)  # as where it is not installed
    assert main(["build", str(capture), "--out", str(tmp_path / "place")]) == 1
    assert "needs Open3D" in capsys.readouterr().err
    assert not (tmp_path / "place").exists()


def test_a_place_without_a_map_is_refused_by_localize(tmp_path, capsys):
    (tmp_path / "place.json").write_text(json.dumps({"source": {"path": "corridor"}}))
    assert main(["localize", str(tmp_path), str(tmp_path), "--out", str(tmp_path / "p.csv")]) == 1
    assert "has no map yet; run synfeal build again, of corridor" in capsys.readouterr().err


def test_photographs_of_a_mesh_need_a_camera_of_their_own(tmp_path):
    (tmp_path / "place.json").write_text(json.dumps({"source": {"path": "room.glb"}}))
    (tmp_path / "map").mkdir()
    nothing = PhotographCamera.read(None, None, exif=True)
    assert open_map(tmp_path, nothing) == (Place(tmp_path).map, nothing)


@pytest.fixture(scope="module")
def meshed(tmp_path_factory) -> Path:
    """A place of a mesh that somebody else made."""
    folder = tmp_path_factory.mktemp("meshed")
    save_glb(folder / "room.glb", furnished_room((4.0, 12.0, 40.0)))
    words = ["build", str(folder / "room.glb"), "--out", str(folder / "place"), "--frames", "60"]
    assert main([*words, "--width", "160"]) == 0
    return folder / "place"


def test_photographs_with_exif_need_nothing_else_in_a_place_of_a_mesh(meshed, tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    film_mm, diagonal_mm = 26, float(np.hypot(36.0, 24.0))
    focal_px = film_mm * np.hypot(WIDTH, HEIGHT) / diagonal_mm
    centre = {"cx": WIDTH / 2, "cy": HEIGHT / 2}
    phone = CameraConfig(width=WIDTH, height=HEIGHT, fx=focal_px, fy=focal_px, **centre)
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = film_mm
    poses = room_from_cam()
    with open_renderer(furnished_room((4.0, 12.0, 40.0)), phone, RenderConfig()) as renderer:
        for number, pose in enumerate(poses):
            image = Image.fromarray(renderer.render(pose))
            image.save(photos / f"{number}.jpg", quality=95, exif=exif)
    assert main(["localize", str(meshed), str(photos), "--out", str(tmp_path / "poses.csv")]) == 0
    found, answers = localized(tmp_path / "poses.csv")
    assert found.mean() >= 0.75
    assert np.median(pose_error(answers, poses[found])[0]) < 0.05


def test_the_report_of_a_mesh_speaks_of_renderings(meshed):
    check = json.loads((meshed / "place.json").read_text())["check"]
    assert (check["kind"], check["pictures"]) == ("renderings", 15)
    page = (meshed / "report.html").read_text()
    assert "of 15 renderings of the mesh" in page
    assert "cm, median of the frames that were left out of the map." in page
    assert "The scan beside photographs" not in page
    assert '<span class="whole">--out poses.csv</span>' in page


def test_what_a_network_will_learn_is_told_and_too_large_a_place_warned_of(caplog):
    told = []
    tell_of_network(3.0, told.append)
    assert "off by about 0.2 m" in told[0]
    assert not caplog.messages
    tell_of_network(30.0, told.append)
    assert len(told) == 1
    assert "off by about 2.4 m" in caplog.text


@pytest.mark.parametrize("options", [(), ("--train",)])
def test_a_network_that_learns_shows_how_long_it_takes(options, tmp_path, caplog, monkeypatch):
    training = logging.getLogger("baselines.training")
    before = training.level
    training.setLevel(logging.NOTSET)

    def made(*_: object, **__: object) -> dict:
        training.getChild("selection").info("64 of 30000 samples, 90 s left")
        return {"check": {"localized": 9, "pictures": 9, "kind": "renderings", "position_m": None}}

    monkeypatch.setattr(api, "build", made)
    try:
        assert main(["build", "room.glb", "--out", str(tmp_path / "room"), *options]) == 0
    finally:
        training.setLevel(before)
    assert ("90 s left" in caplog.text) is bool(options)


def test_a_map_that_finds_little_is_warned_of(tmp_path, caplog, monkeypatch):
    for found, warned in ((7, True), (8, False)):
        check = {"localized": found, "pictures": 15, "kind": "renderings", "position_m": None}
        monkeypatch.setattr(api, "build", lambda *_, check=check, **__: {"check": check})
        caplog.clear()
        assert main(["build", "duck.glb", "--out", str(tmp_path / "duck")]) == 0
        assert ("fewer than half of the renderings" in caplog.text) is warned


def frames_of(tmp_path, depth_mm, extent_m, count) -> PosedFrames:
    """Frames along x whose depth images all hold one value, but for a far tenth."""
    image = np.full((20, 20), depth_mm, np.uint16)
    image[:2] = 9000
    Image.fromarray(image).save(tmp_path / "depth.png")
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, 0, 3] = np.linspace(0.0, extent_m, count)
    names = tuple(f"frame-{index:06d}" for index in range(count))
    return PosedFrames(
        names, (tmp_path / "c.png",) * count, (tmp_path / "depth.png",) * count, poses
    )


@pytest.mark.parametrize(
    ("depth_mm", "extent_m", "count", "stride", "voxel_m"),
    [
        (1800, 3.0, 60, 1, 0.01),  # 8 mm a pixel: the finest voxel
        (3300, 3.0, 300, 2, 0.015),  # 15 mm a pixel; half of the frames are spared
        (1800, 30.0, 60, 1, 0.02),  # a corridor
        (1800, 3.0, 1500, 4, 0.01),
    ],
)
def test_settings_of_a_scan_follow_from_the_capture(
    depth_mm, extent_m, count, stride, voxel_m, tmp_path
):
    choice = choose(frames_of(tmp_path, depth_mm, extent_m, count), depth_focal_px=220.0)
    assert (choice.stride, choice.voxel_m) == (stride, voxel_m)
    assert choice.max_depth_m == 6.0  # a tenth of the pixels is at 9 m, beyond what sensors tell
    assert choice.extent_m == extent_m


def test_the_plan_shows_places_from_above_in_proportion():
    places = [
        {"position_m": [0.0, 5.0, 0.0], "error_m": 0.01},
        {"position_m": [4.0, 9.0, 0.0], "error_m": 0.3},
        {"position_m": [4.0, 5.0, -1.0], "error_m": None},
    ]
    from_y_up = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])
    plan = plan_of(places, from_y_up)
    assert [dot.kind for dot in plan.dots] == ["close", "far", "lost"]
    first, second, third = plan.dots
    assert second.x_px == third.x_px
    assert first.y_px == second.y_px  # heights do not show
    assert (second.y_px - third.y_px) * 4.0 == pytest.approx(third.x_px - first.x_px)
    assert plan.scale_px * 4.0 == pytest.approx((third.x_px - first.x_px) * plan.scale_m)
