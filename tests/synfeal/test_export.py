"""Exports read back by other programs' readers, or by hand: a point lands where it was drawn."""

import json
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd
import pycolmap
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from synfeal.cli import main
from tests.support.collected import refused
from tests.support.damaged_sets import frame_files

LENS = (0.1, -0.05, 0.001, -0.002, 0.01)


class Exported(NamedTuple):
    """Findings of a format's reader: pinhole, poses, colour and depth images by frame."""

    project: Callable  # points in the camera (x, y, z) to pixels
    cam_from_world: list
    colors: list
    depth_m: list | None = None


def run(dataset, to, out, *more):
    return main(["export", str(dataset), "--to", to, "--out", str(out), *more])


def read_colmap(out):
    model = pycolmap.Reconstruction(str(out / "sparse" / "0"))
    images = [model.images[key] for key in sorted(model.images)]
    camera = model.cameras[1]
    poses = [np.vstack([image.cam_from_world().matrix(), [0, 0, 0, 1]]) for image in images]
    return Exported(
        lambda points: np.asarray(camera.img_from_cam(points)),
        poses,
        [out / "images" / image.name for image in images],
    )


def read_nerfstudio(out):
    """Cameras look along -z with y up; depth is scaled by 1e-3."""
    meta = json.loads((out / "transforms.json").read_text())

    def project(points):
        x, y, z = (points * [1, -1, -1]).T  # to the axes of the format
        column = meta["fl_x"] * x / -z + meta["cx"]
        return np.stack([column, meta["cy"] - meta["fl_y"] * y / -z], axis=1)

    gl_from_cam = np.diag([1, -1, -1, 1])
    frames = meta["frames"]
    return Exported(
        project,
        [gl_from_cam @ np.linalg.inv(np.array(f["transform_matrix"])) for f in frames],
        [out / frame["file_path"] for frame in frames],
        [np.asarray(Image.open(out / f["depth_file_path"])) * 1e-3 for f in frames],
    )


def read_tum(out):
    """As TUM's tools do: lists after three lines of comment, quaternions with w last."""
    poses, colors, depths, values = [], [], [], []
    for name in ("seq-01", "seq-02"):
        files = (out / name / f"{kind}.txt" for kind in ("rgb", "depth", "groundtruth"))
        lists = [path.read_text().splitlines() for path in files]
        assert all(line[0] == "#" for lines in lists for line in lines[:3])
        values = lists[0][1].split(": ")[1].replace(";", "").split()
        for rgb, depth, truth in zip(*(lines[3:] for lines in lists), strict=True):
            time, *pose = map(float, truth.split())
            assert float(rgb.split()[0]) == float(depth.split()[0]) == time
            world_from_cam = np.eye(4)
            world_from_cam[:3, :3] = Rotation.from_quat(pose[3:]).as_matrix()
            world_from_cam[:3, 3] = pose[:3]
            poses.append(np.linalg.inv(world_from_cam))
            colors.append(out / name / rgb.split()[1])
            depths.append(np.asarray(Image.open(out / name / depth.split()[1])) / 5000)
    fx, fy, cx, cy = (float(values[values.index(key) + 1]) for key in ("fx", "fy", "cx", "cy"))
    scale, offset = np.array([fx, fy]), np.array([cx + 0.5, cy + 0.5])
    return Exported(lambda p: p[:, :2] / p[:, 2:] * scale + offset, poses, colors, depths)


def read_ace(out):
    """By the rules of ACE's loader: the files of sorted folders go together, by place."""
    poses, colors, depths = [], [], []
    matrix = np.eye(3)
    for split in ("train", "test"):
        folders = [sorted((out / split / name).iterdir()) for name in ("rgb", "poses", "depth")]
        calibrations = sorted((out / split / "calibration").iterdir())
        assert {len(folder) for folder in folders} == {len(calibrations)}
        colors += folders[0]
        poses += [np.linalg.inv(np.loadtxt(path)) for path in folders[1]]
        depths += [np.asarray(Image.open(path)) / 1000 for path in folders[2]]
        matrix = np.loadtxt(calibrations[0])
        assert matrix[0, 0] == matrix[1, 1]  # asserted by test_ace.py
    return Exported(lambda p: (p @ matrix.T)[:, :2] / p[:, 2:], poses, colors, depths)


def read_hloc(out):
    """By the rules of hloc: binary models by name, the query list with its own camera."""
    model = pycolmap.Reconstruction(str(out / "model"))
    assert {path.suffix for path in (out / "model").iterdir()} == {".bin"}
    by_name = {image.name: image for image in model.images.values()}
    lines = (out / "queries_with_intrinsics.txt").read_text().splitlines()
    queries = [line.split() for line in lines]
    name, kind, width, height, *parameters = queries[0]
    camera = pycolmap.Camera(
        model=kind, width=int(width), height=int(height), params=list(map(float, parameters))
    )
    reference = pycolmap.Reconstruction(str(out / "sfm_reference"))
    lists = [(out / f"list_{split}.txt").read_text().split() for split in ("train", "test")]
    assert sorted(image.name for image in reference.images.values()) == sorted(lists[0])
    assert [query[0] for query in queries] == lists[1]
    assert name in by_name
    names = [name for listed in lists for name in listed]
    return Exported(
        lambda points: np.asarray(camera.img_from_cam(points)),
        [np.vstack([by_name[n].cam_from_world().matrix(), [0, 0, 0, 1]]) for n in names],
        [out / "images" / name for name in names],
    )


def read_mstransformer(out):
    """By the rules of its loader: columns by name, image paths below the directory."""
    poses, colors = [], []
    for split in ("train", "test"):
        table = pd.read_csv(out / f"{split}.csv")
        assert set(table["split"]) == {split}
        assert set(table["scene"]) == {"set"}
        colors += [out / path for path in table["img_path"]]
        matrices = np.tile(np.eye(4), (len(table), 1, 1))
        quat = table[["q1", "q2", "q3", "q4"]].to_numpy()
        matrices[:, :3, :3] = Rotation.from_quat(quat, scalar_first=True).as_matrix()
        matrices[:, :3, 3] = table[["t1", "t2", "t3"]]
        poses += list(np.linalg.inv(matrices))
    return Exported(None, poses, colors)


READERS = {
    "ace": read_ace,
    "colmap": read_colmap,
    "hloc": read_hloc,
    "nerfstudio": read_nerfstudio,
    "mstransformer": read_mstransformer,
    "tum": read_tum,
}


@pytest.mark.parametrize("to", READERS)
def test_what_is_exported_is_read_back(to, planar, tmp_path):
    assert run(planar, to, tmp_path / "out") == 0
    exported = READERS[to](tmp_path / "out")
    names = [path for s in ("seq-01", "seq-02") for path in frame_files(planar, "pose.txt", s)]
    assert len(exported.cam_from_world) == len(names) == 32
    for index, path in enumerate(names):
        product = exported.cam_from_world[index] @ np.loadtxt(path)
        np.testing.assert_allclose(product, np.eye(4), atol=1e-9)
        color = path.with_name(path.name.replace("pose.txt", "color.png"))
        assert exported.colors[index].is_symlink()
        assert exported.colors[index].read_bytes() == color.read_bytes()
        if exported.depth_m is not None:
            depth_mm = np.asarray(Image.open(str(color).replace("color", "depth")))
            expected = np.where(depth_mm == 65535, 0, depth_mm / 1000)
            np.testing.assert_allclose(exported.depth_m[index], expected, atol=1e-4)
    if to != "mstransformer":  # it knows no camera
        check_pixels(exported, np.loadtxt(names[3]), index=3)
    assert run(planar, to, tmp_path / "copies", "--copy") == 0
    assert not any(path.is_symlink() for path in READERS[to](tmp_path / "copies").colors)


def check_pixels(exported, pose, index):
    """A point lands at the pixel where it was drawn: the scene's wall is the plane x = 3."""
    focal = 48 / np.tan(np.radians(30))
    pixels = np.array([[0.5, 0.5], [95.5, 0.5], [40.5, 10.5]])
    rays = np.column_stack([(pixels - [48, 36]) / focal, np.ones(3)]) @ pose[:3, :3].T
    on_wall = pose[:3, 3] + rays * ((3.0 - pose[0, 3]) / rays[:, :1])
    cam_from_world = exported.cam_from_world[index]
    points = on_wall @ cam_from_world[:3, :3].T + cam_from_world[:3, 3]
    np.testing.assert_allclose(exported.project(points), pixels, atol=1e-6)


def test_splits_are_kept(planar, tmp_path):
    for to in ("colmap", "nerfstudio", "tum"):
        assert run(planar, to, tmp_path / to) == 0
    for split, count, sequence in (("train", 24, "seq-01"), ("test", 8, "seq-02")):
        names = (tmp_path / "colmap" / f"{split}.txt").read_text().split()
        assert len(names) == count
        assert {name.split("/")[0] for name in names} == {sequence}
        assert all((tmp_path / "colmap" / "images" / name).exists() for name in names)
        meta = json.loads((tmp_path / "nerfstudio" / "transforms.json").read_text())
        assert meta[f"{split}_filenames"] == [f"images/{name}" for name in names]
        assert meta["val_filenames"] == meta["test_filenames"]
    assert (tmp_path / "tum" / "TestSplit.txt").read_text() == "sequence2\n"


def test_a_lens_goes_to_nerfstudio_and_ace_refuses_it(planar, tmp_path, damaged, capsys):
    lens = tmp_path / "cameras.txt"
    lens.write_text("1 FULL_OPENCV 96 72 80 81 47 37 0.1 -0.05 0.001 -0.002 0.01 0 0 0\n")
    assert run(planar, "nerfstudio", tmp_path / "out", "--camera", str(lens)) == 0
    meta = json.loads((tmp_path / "out" / "transforms.json").read_text())
    assert tuple(meta[key] for key in ("k1", "k2", "p1", "p2", "k3")) == LENS
    assert tuple(meta[key] for key in ("fl_x", "fl_y", "cx", "cy")) == (80, 81, 47, 37)
    lens.write_text("1 OPENCV 96 72 80 80 47 37 0.1 -0.05 0.001 -0.002\n")
    more = ("--to", "ace", "--out", tmp_path / "ace", "--camera", lens)
    assert "no distortion" in refused(capsys, "export", damaged, *more)
    assert not (tmp_path / "ace").exists()


def test_tum_loses_what_is_beyond_its_range_and_says_so(damaged, tmp_path, caplog):
    path = frame_files(damaged, "depth.png")[0]
    depth = np.asarray(Image.open(path)).copy()
    depth[0, :4] = 13107, 13108, 65535, 0
    Image.fromarray(depth).save(path)
    assert run(damaged, "tum", tmp_path / "out") == 0
    assert "beyond 13.1 m" in caplog.text
    written = np.asarray(Image.open(tmp_path / "out/seq-01/depth/0.000000.png"))
    assert written[0, :4].tolist() == [65535, 0, 0, 0]


@pytest.mark.parametrize("to", ["ace", "hloc", "mstransformer"])
def test_formats_of_two_splits_need_both(to, damaged, tmp_path, capsys):
    for name in ("TrainSplit.txt", "TestSplit.txt"):
        (damaged / name).unlink()
    line = refused(capsys, "export", damaged, "--to", to, "--out", tmp_path / "out")
    assert "TrainSplit.txt: lists no frame" in line
    assert not (tmp_path / "out").exists()
