"""Archived sequences: unpacked by other programs they are the data set; readers need not unpack."""

import os
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from baselines.labels.batches import link_images
from baselines.labels.rgbd.frames import frame_generator
from synfeal.cli import main
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import ArchivedFile, foreign_members, frame_file, write_archive
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.render_sequence import write_sequence
from synfeal.dataset.sevenscenes import frame_paths, read_pose, read_split
from synfeal.render.surface import Layers
from tests.support.collected import collect, tree_of
from tests.support.damaged_sets import CAMERA
from tests.synfeal.test_dataset import FakeRenderer, poses_of


def archived(folder, out):
    """A copy with every sequence as an archive."""
    shutil.copytree(folder, out)
    for directory in sorted(out.glob("seq-*")):
        write_archive(directory, out / f"{directory.name}.zip")
        shutil.rmtree(directory)
    return out


@pytest.fixture(scope="module")
def packed(planar, tmp_path_factory):
    return archived(planar, tmp_path_factory.mktemp("packed") / "set")


def unpacked(folder):
    """Unpack every archive where it lies, with another program than ours where there is one."""
    unzip = shutil.which("unzip")
    for path in sorted(folder.glob("seq-*.zip")):
        command = [unzip, "-q"] if unzip else [sys.executable, "-m", "zipfile", "-e"]
        subprocess.run([*command, path.name, *([] if unzip else ["."])], cwd=folder, check=True)
        path.unlink()
    return folder


def test_other_programs_unpack_the_data_set(planar, packed, tmp_path):
    assert sorted(path.name for path in packed.glob("seq-*")) == ["seq-01.zip", "seq-02.zip"]
    copy = Path(shutil.copytree(packed, tmp_path / "set"))
    assert tree_of(unpacked(copy)) == tree_of(planar)


def test_nothing_is_compressed_and_nothing_but_frames_decides_the_bytes(planar, packed, tmp_path):
    directory = Path(shutil.copytree(planar / "seq-01", tmp_path / "seq-01"))
    for path in directory.iterdir():
        os.utime(path, (1e9, 1e9))
        path.chmod(0o600)
    (directory / "Thumbs.db").write_bytes(b"not a frame")
    write_archive(directory, tmp_path / "seq-01.zip")
    data = (tmp_path / "seq-01.zip").read_bytes()
    assert data == (packed / "seq-01.zip").read_bytes()
    # First local header (APPNOTE 4.3.7): method 0 is stored; the name, then the file as it is.
    signature, method, size, name_length = struct.unpack("<I4xH8x4xIH", data[:28])
    assert (signature, method) == (0x04034B50, 0)
    assert data[30 : 30 + name_length] == b"seq-01/frame-000000.color.png"
    first = (planar / "seq-01" / "frame-000000.color.png").read_bytes()
    assert data[30 + name_length :][:size] == first


def test_readers_see_the_same_frames(planar, packed, tmp_path):
    assert read_split(packed, "test") == [packed / "seq-02.zip"]
    inside, outside = packed / "seq-01.zip", planar / "seq-01"
    for kind, read in (("pose.txt", read_pose), ("depth.png", read_depth_m)):
        both = [frame_paths([at], kind) for at in (inside, outside)]
        assert [path.name for path in both[0]] == [path.name for path in both[1]]
        np.testing.assert_array_equal(read(both[0][3]), read(both[1][3]))
    # The noise of a depth sensor is that of the frame, however its sequence is kept.
    names = (frame_file(at, "frame-000004.depth.png") for at in (inside, outside))
    assert len({frame_generator(1, name).random() for name in names}) == 1
    for at, name in ((inside, "in.npy"), (outside, "out.npy")):
        pack_frames([at], 32, tmp_path / name)
    assert (tmp_path / "in.npy").read_bytes() == (tmp_path / "out.npy").read_bytes()
    color = [frame_paths([at], "color.png")[:2] for at in (inside, outside)]
    for paths, name in zip(color, ("in", "out"), strict=True):
        link_images(paths, CAMERA, tmp_path / name)
    assert tree_of(tmp_path / "in") == tree_of(tmp_path / "out")


def test_validate_passes_archives_as_directories(planar, packed, capsys):
    reports = []
    for folder in (planar, packed):
        assert main(["validate", str(folder)]) == 0
        reports.append(capsys.readouterr().out.splitlines()[1:])
    assert reports[0] == reports[1]


def test_exports_are_those_of_the_directories(planar, packed, tmp_path):
    for folder, more in ((planar, ["--copy"]), (packed, [])):
        out = tmp_path / folder.parent.name
        assert main(["export", str(folder), "--to", "tum", "--out", str(out), *more]) == 0
    first, second = sorted(tmp_path.iterdir())
    assert tree_of(first) == tree_of(second)
    assert not [path for path in second.rglob("*") if path.is_symlink()]


def changed(packed, tmp_path, **members):
    """A data set whose first archive has more members, which may replace others."""
    folder = Path(shutil.copytree(packed, tmp_path / "set"))
    with zipfile.ZipFile(folder / "seq-01.zip") as old:
        content = {info.filename: old.read(info) for info in old.infolist()}
    with zipfile.ZipFile(folder / "seq-01.zip", "w", zipfile.ZIP_DEFLATED) as new:
        for name, data in {**content, **members}.items():
            new.writestr(name, data)
    return folder


OUTSIDE = ("../evil.txt", "/etc/evil", "seq-01/../../evil", "seq-01/sub/evil", "seq-01/..", "evil")


@pytest.mark.parametrize("name", [*OUTSIDE, "seq-02/frame-000000.color.png"])
def test_members_that_unpack_elsewhere_are_found(packed, tmp_path, name, capsys):
    folder = changed(packed, tmp_path, **{name: b"evil"})
    assert main(["validate", str(folder)]) == 1
    assert f"seq-01.zip: '{name}' does not unpack to one file in seq-01" in capsys.readouterr().err


def test_archives_of_others_are_read(packed, tmp_path):
    # 7-Scenes' own hold the directory and thumbnails too, and are compressed.
    folder = changed(packed, tmp_path, **{"seq-01/": b"", "seq-01/Thumbs.db": b"thumbs"})
    assert main(["validate", str(folder)]) == 0
    twice = pytest.warns(UserWarning, match="Duplicate")
    with twice, zipfile.ZipFile(folder / "seq-01.zip", "a") as again:
        again.writestr("seq-01/Thumbs.db", b"twice")
    assert foreign_members(folder / "seq-01.zip") == ["seq-01/Thumbs.db"]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda data: data[:-40], r"seq-01\.zip: cannot be read as a sequence"),
        (lambda data: data[:5000] + bytes(9) + data[5009:], r"Bad CRC-32|read as an image"),
    ],
)
def test_damage_ends_in_one_line(packed, tmp_path, damage, message, capsys):
    folder = Path(shutil.copytree(packed, tmp_path / "set"))
    path = folder / "seq-01.zip"
    path.write_bytes(damage(path.read_bytes()))
    assert main(["validate", str(folder)]) == 1
    errors = capsys.readouterr().err.replace("\r", "\n").splitlines()
    assert any(line.startswith("error: ") and re.search(message, line) for line in errors)
    assert "Traceback" not in "".join(errors)


def test_a_member_that_says_it_is_huge_is_not_read(packed):
    with pytest.raises(OSError, match="too many for such a file"):
        ArchivedFile(packed / "seq-01.zip", "frame-000000.color.png").read_bytes(most_bytes=100)
    with pytest.raises(FileNotFoundError, match=r"seq-01\.zip/frame-000099\.color\.png"):
        ArchivedFile(packed / "seq-01.zip", "frame-000099.color.png").read_bytes()


def test_a_sequence_is_rendered_into_an_archive_or_not_at_all(tmp_path):
    poses = poses_of(3)
    for out in (tmp_path / "plain" / "seq-01", tmp_path / "packed" / "seq-01.zip"):
        write_sequence(FakeRenderer(), poses, out, Layers(depth=True))
    assert [path.name for path in (tmp_path / "packed").iterdir()] == ["seq-01.zip"]
    assert tree_of(unpacked(tmp_path / "packed")) == tree_of(tmp_path / "plain")
    with pytest.raises(RuntimeError, match="on fire"):
        write_sequence(FakeRenderer(2), poses, tmp_path / "none" / "seq-01.zip", Layers(depth=True))
    assert list((tmp_path / "none").iterdir()) == []


def test_collections_are_archived(mesh, calm, tmp_path):
    out = tmp_path / "set"
    assert collect(mesh, out, "--depth", "--archive") == 0
    assert [path.suffix for path in out.glob("seq-*")] == [".zip"] * 4
    assert main(["validate", str(out)]) == 0
    assert tree_of(unpacked(out)) == tree_of(calm)
