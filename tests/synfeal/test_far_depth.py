"""Data sets of places larger than 65.5 m, whose depth is stored in coarser units: every reader."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from baselines.references.map_frames import FrameChoice, read_map_frames
from synfeal.api import open_dataset
from synfeal.captures.formats import read_capture
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig
from synfeal.evaluation.reprojection import depth_of_images
from synfeal.mesh.save import save_glb
from synfeal.pairing.frames import read_depth_frames
from synfeal.scanning.camera import CameraOptions
from tests.support.collected import collect, painted, refused

SIZE_M = np.array([160.0, 90.0, 40.0])
UNITS_PER_M = 200.0


@pytest.fixture(scope="module")
def hall(tmp_path_factory):
    """A hall of 160 x 90 x 40 m."""
    path = tmp_path_factory.mktemp("hall") / "hall.glb"
    save_glb(path, painted(trimesh.creation.box(SIZE_M), seed=3))
    return path


@pytest.fixture(scope="module")
def far(hall):
    out = hall.parent / "set"
    options = ("--depth", "--depth-scale", "200", "--far", "300", "--pitch", "-5", "5")
    assert collect(hall, out, *options) == 0
    return out


def true_depth_m(folder, number):
    """Depth (H, W) of the hall's walls in closed form, from a frame's pose."""
    manifest = json.loads((folder / "manifest.json").read_text())
    camera = CameraConfig.model_validate(manifest["camera"])
    fx, fy, cx, cy = camera.intrinsics
    pose = np.loadtxt(folder / f"seq-01/frame-{number:06d}.pose.txt")
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = np.stack([(column - cx) / fx, (row - cy) / fy, np.ones_like(row)], axis=-1)
    rays = rays @ pose[:3, :3].T
    walls = np.sign(rays) * SIZE_M / 2
    return ((walls - pose[:3, 3]) / rays).min(axis=-1)


def agree(depth_m, folder, number, slack=1.01):
    np.testing.assert_allclose(depth_m, true_depth_m(folder, number), atol=0.5 * slack / 200 + 1e-4)


def test_the_file_holds_the_units_that_it_and_the_manifest_say(far):
    manifest = json.loads((far / "manifest.json").read_text())
    assert manifest["camera"]["depth_units_per_m"] == UNITS_PER_M
    assert manifest["camera"]["far_m"] == 300.0
    assert "in units of 1/200 m" in manifest["format"]
    seen = [np.asarray(Image.open(path)) for path in sorted(far.glob("seq-01/*.depth.png"))]
    farthest_m = max(image.max() for image in seen) / UNITS_PER_M
    assert farthest_m > 70.0
    for number, units in enumerate(seen):
        agree(units / UNITS_PER_M, far, number)


def test_every_reader_follows_them(far):
    everything = open_dataset(far)
    agree(everything.train.depth_m(3), far, 3)
    pairs = read_depth_frames(far, ("train",), None, 1)
    agree(pairs.depth_m(3), far, 3)
    frames = read_map_frames(far, FrameChoice(), CameraOptions())
    assert frames.rgbd.depth_units_per_m == UNITS_PER_M
    agree(frames.read_depth_m(3), far, 3)
    (cells,) = depth_of_images([far / "seq-01/frame-000003.depth.png"], pairs.camera)
    assert np.isin(cells, pairs.depth_m(3)).all()


def test_validate_finds_nothing_wrong_and_a_wrong_unit_at_once(far, tmp_path, capfd):
    assert main(["validate", str(far)]) == 0
    wrong = Path(shutil.copytree(far, tmp_path / "wrong"))
    manifest = json.loads((wrong / "manifest.json").read_text())
    del manifest["camera"]["depth_units_per_m"]
    (wrong / "manifest.json").write_text(json.dumps(manifest))
    capfd.readouterr()
    assert main(["validate", str(wrong)]) == 1
    said = capfd.readouterr().err
    assert "a metre is stored as 200, the manifest (camera.depth_units_per_m) 1000" in said
    (wrong / "seq-01" / "frame-000000.depth.png").unlink()  # the first of the others says it then
    assert main(["validate", str(wrong)]) == 1
    said = capfd.readouterr().err
    assert "frame-000001.depth.png: says that a metre is stored as 200" in said


def test_what_is_exported_is_as_far_away(far, tmp_path, caplog):
    assert (
        main(["export", str(far), "--to", "nerfstudio", "--copy", "--out", str(tmp_path / "nerf")])
        == 0
    )
    frame = read_capture(tmp_path / "nerf").frames[3]
    agree(frame.read_depth_m(), far, 3)
    assert "beyond" not in caplog.text
    assert main(["export", str(far), "--to", "ace", "--out", str(tmp_path / "ace")]) == 0
    assert "of the depths are beyond 65.5 m, more than ACE's images hold" in caplog.text


def test_a_bag_of_ros_has_metres(far, tmp_path):
    rosbags = pytest.importorskip("rosbags.highlevel")
    from rosbags.typesys import Stores, get_typestore

    assert main(["export", str(far), "--to", "rosbag", "--out", str(tmp_path / "bags")]) == 0
    store = get_typestore(Stores.ROS2_HUMBLE)
    with rosbags.AnyReader([tmp_path / "bags/seq-01"], default_typestore=store) as reader:
        topic = [c for c in reader.connections if c.topic == "/camera/depth/image_raw"]
        raw = [item for *_, item in reader.messages(topic)][3]
        message = reader.deserialize(raw, topic[0].msgtype)
    assert message.encoding == "32FC1"
    depth_m = message.data.view("<f4").reshape(message.height, message.width)
    agree(depth_m, far, 3)


def test_depth_in_millimetres_counts_what_it_loses_and_names_the_remedy(hall, tmp_path, caplog):
    assert collect(hall, tmp_path / "set", "--depth", "--far", "300") == 0
    warnings = [record.getMessage() for record in caplog.records if "65.5 m" in record.message]
    assert warnings
    assert "`depth_scale=100`" in warnings[0]


def test_what_processes_warn_of_is_worded_as_the_command_line_has_it(hall, tmp_path):
    given = [
        *("collect", hall, "--out", tmp_path / "set", "--frames", 4, "--sequence-frames", 2),
        *("--width", 64, "--height", 48, "--depth", "--far", 300, "--cores", 2),
    ]
    words = [sys.executable, "-m", "synfeal.cli", *map(str, given)]
    run = subprocess.run(words, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    warnings = [line for line in run.stderr.splitlines() if "65.5 m" in line]
    assert len(warnings) == 2  # one of each sequence
    for line in warnings:
        assert line.startswith("WARNING: seq-")
        assert "(--depth-scale 100)" in line
        assert "`" not in line


def test_a_scale_without_depth_is_refused(hall, tmp_path, capfd):
    given = ("collect", hall, "--out", tmp_path / "s", "--frames", 4, "--depth-scale", 100)
    line = refused(capfd, *given)
    assert "--depth-scale: is of depth images; give --depth, too" in line
