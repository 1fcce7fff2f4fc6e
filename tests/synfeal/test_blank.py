"""Nothing blank in silence: what would show nothing is refused or said before it is rendered."""

import json
import logging

import pytest
import trimesh

from synfeal.cli import main
from synfeal.config.dataset import CameraConfig
from synfeal.mesh.save import save_glb
from tests.support.collected import painted, refused

CAMERA = CameraConfig(width=64, height=48)
SMALL = ("--frames", "30", "--spacing", "0.8", "--width", "64", "--height", "48")


def box_room(scale=1.0):
    """A room of 6 x 5 x 3 units, times ``scale``."""
    return trimesh.creation.box((6.0, 5.0, 3.0)).subdivide().subdivide().apply_scale(scale)


def save(path, mesh, rgb=None):
    save_glb(path, painted(mesh, rgb))
    return path


def millimetres(folder):
    return save(folder / "room.glb", box_room(1000.0))


def kilometres(folder):
    return save(folder / "room.glb", box_room(0.001))


def one_grey(folder):
    return save(folder / "room.glb", box_room(), (99, 99, 99))


def obj_without_its_mtl(folder):
    mesh = box_room()
    lines = ["mtllib room.mtl", *("v {} {} {}".format(*v) for v in mesh.vertices)]
    lines += ["vt {} {}".format(*v[:2]) for v in mesh.vertices]
    faces = [" ".join(["f", *(f"{i + 1}/{i + 1}" for i in face)]) for face in mesh.faces]
    half = len(faces) // 2
    lines += ["usemtl one", *faces[:half], "usemtl two", *faces[half:]]
    (folder / "room.obj").write_text("\n".join(lines) + "\n")
    return folder / "room.obj"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (millimetres, ["room.glb", "100% of the pixels", "far_m (100 m)", "--unit-m"]),
        (kilometres, ["room.glb", "near_m (0.05 m)", "--unit-m"]),
        (one_grey, ["room.glb", "one colour"]),
        (obj_without_its_mtl, ["room.obj", "one colour", ".mtl"]),
    ],
)
def test_what_is_certainly_blank_is_refused_before_rendering(make, words, tmp_path, capsys, caplog):
    mesh = make(tmp_path)
    before = sorted(tmp_path.iterdir())
    line = refused(capsys, "collect", "--mesh", mesh, "--out", tmp_path / "set", *SMALL)
    assert all(word in line for word in words), line
    assert sorted(tmp_path.iterdir()) == before


def open_room():
    """Neither ceiling nor one of the walls."""
    mesh = box_room()
    mesh.update_faces(mesh.face_normals[:, [0, 2]].max(axis=1) < 0.5)
    return mesh


@pytest.mark.parametrize(("mesh", "warns"), [(box_room(), False), (open_room(), True)])
def test_collect_always_says_how_many_pixels_are_empty(mesh, warns, tmp_path, capsys, caplog):
    path, out = save(tmp_path / "room.glb", mesh), tmp_path / "set"
    with caplog.at_level(logging.WARNING):
        assert main(["collect", "--mesh", str(path), "--out", str(out), *SMALL]) == 0
    share = json.loads((out / "coverage.json").read_text())["train"]["empty_pixels"]["share"]
    assert (share > 0.1) == warns
    assert f"empty pixels: {share:.1%}" in capsys.readouterr().out
    assert any("will be empty" in line for line in caplog.messages) == warns
