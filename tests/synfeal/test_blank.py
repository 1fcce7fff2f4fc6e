"""Nothing blank in silence: what would show nothing is refused or said before it is rendered."""

import dataclasses
import json
import logging
import re

import pytest
import trimesh

from synfeal.cli import main
from synfeal.collection.run import refuse_invisible
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
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


@pytest.mark.parametrize("rgb", [(0, 255, 0), (1, 0, 1)])
def test_one_colour_is_named_with_what_was_left_out_on_reading(rgb):
    found = ("part 'front': nowhere opaque enough to be seen; left out",)
    mesh = dataclasses.replace(painted(box_room(), rgb), findings=found)
    shown = " ".join(map(str, rgb))
    with pytest.raises(InputError, match=rf"{shown} of 255.*on reading: part 'front': nowhere"):
        refuse_invisible(mesh, CAMERA, "sheets.glb")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (millimetres, ["room.glb", "100% of the pixels", "far_m (100 m)", "--unit"]),
        (kilometres, ["room.glb", "near_m (0.05 m)", "--unit"]),
        (one_grey, ["room.glb", "one colour"]),
        (obj_without_its_mtl, ["room.obj", "one colour", ".mtl"]),
    ],
)
def test_what_is_certainly_blank_is_refused_before_rendering(make, words, tmp_path, capsys, caplog):
    mesh = make(tmp_path)
    before = sorted(tmp_path.iterdir())
    line = refused(capsys, "collect", mesh, "--out", tmp_path / "set", *SMALL)
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
        assert main(["collect", str(path), "--out", str(out), *SMALL]) == 0
    share = json.loads((out / "coverage.json").read_text())["train"]["empty_pixels"]["share"]
    assert (share > 0.1) == warns
    assert f"empty pixels: {share:.1%}" in capsys.readouterr().out
    said = [line for line in caplog.messages if "will be empty" in line]
    assert bool(said) == warns
    assert all("`box`" in line for line in said)


def test_what_helps_against_empty_pixels_is_not_what_was_given(tmp_path, caplog, monkeypatch):
    monkeypatch.setattr("synfeal.collection.run.WARN_ABOVE", 0.005)
    path, box = save(tmp_path / "room.glb", open_room()), ["-2.5", "2.5", "-2", "2", "-0.5", "0.5"]
    for more, remedy in (([], "`min_seen=0.9`"), (["--min-seen", "0.9"], "`pitch_deg`")):
        caplog.clear()
        command = ["collect", str(path), "--box", *box, *SMALL, *more]
        assert main([*command, "--out", str(tmp_path / f"set{len(more)}")]) == 0
        said = [line for line in caplog.messages if "will be empty" in line]
        assert all(remedy in line and "synfeal inspect" not in line for line in said)
        assert said or more


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        (("--frames", "20"), ["20 training frames lie on one straight path", "`spacing_m`"]),
        (("--frames", "60", "--spacing", "0.8"), []),
        (("--frames", "20", "--mode", "random"), []),
    ],
)
def test_few_paths_are_said_before_they_are_rendered(frames, words, tmp_path, capsys, caplog):
    path, out = save(tmp_path / "room.glb", box_room()), tmp_path / "set"
    size = ("--width", "32", "--height", "24", "--test-frames", "16")
    assert main(["collect", str(path), "--out", str(out), *frames, *size]) == 0
    said = [line for line in caplog.messages if "straight path" in line]
    assert bool(said) == bool(words)
    assert all(word in said[0] for word in words)
    assert not any("test frames" in line for line in said)
    shown = capsys.readouterr().out
    paths = re.search(r"16 test frames on (\d+) paths", shown)
    assert (paths is not None) == ("random" not in frames)
    assert paths is None or int(paths[1]) >= 8
