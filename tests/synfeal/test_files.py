"""Files that never end, links, permissions, and places that cannot be written."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from synfeal.camera.calibration import read_calibration
from synfeal.config.load import read_yaml
from synfeal.dataset.images import read_image
from synfeal.dataset.posed_sequence import _nearest, read_posed_sequence
from synfeal.dataset.poses_in import read_pose_list
from synfeal.dataset.sevenscenes import pose_text, read_pose
from synfeal.errors import InputError
from synfeal.records.files import (
    atomic_directory,
    atomic_path,
    read_json,
    refuse_unwritable,
    write_text,
)

READERS: dict[str, Callable[[Path], Any]] = {
    "yaml": read_yaml,
    "calibration": read_calibration,
    "pose": read_pose,
    "poses": lambda path: read_pose_list(path),
    "image": read_image,
}


@pytest.mark.parametrize("reader", READERS)
def test_what_never_ends_is_not_read(tmp_path: Path, reader: str) -> None:
    pipe, device = tmp_path / "pipe.yaml", tmp_path / "zero.yaml"
    os.mkfifo(pipe)  # that nobody writes to: opening it would wait for ever
    device.symlink_to("/dev/zero")
    for path in (pipe, device):
        with pytest.raises(InputError, match="it is a pipe or a device"):
            READERS[reader](path)
    with pytest.raises(ValueError, match="pipe or a device"):
        read_json(pipe)


@pytest.mark.parametrize("reader", ["yaml", "calibration"])
def test_megabytes_of_comments_are_not_parsed(tmp_path: Path, reader: str) -> None:
    path = tmp_path / "long.yaml"
    path.write_text("# nothing\n" * 200_000)
    with pytest.raises(InputError, match=r"it has 2 MB, and more than 1\.05 MB are not read"):
        READERS[reader](path)


@pytest.mark.parametrize("text", ["02000", "-017", "1:30", "0_7"])
def test_numbers_that_would_become_others_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "noise.yaml"
    path.write_text(f"full_well_e: {text}\n")
    with pytest.raises(InputError, match=r"line 1: .* would be read as another number"):
        read_yaml(path)
    path.write_text("a: 2000\nb: 0\nc: -7\nd: 0x10\ne: 1_000\n")
    assert read_yaml(path) == {"a": 2000, "b": 0, "c": -7, "d": 16, "e": 1000}


def test_a_member_that_unpacks_to_zeros_is_no_pose(tmp_path: Path) -> None:
    Image.new("RGB", (8, 6)).save(tmp_path / "image.png")
    for count, said in ((2**17, "are too many for such a file"), (99, "it holds zero bytes")):
        with zipfile.ZipFile(tmp_path / "seq-01.zip", "w", zipfile.ZIP_DEFLATED) as packed:
            packed.write(tmp_path / "image.png", "seq-01/frame-000000.color.png")
            packed.writestr("seq-01/frame-000000.pose.txt", bytes(count))
        with pytest.raises(InputError, match=f"pose.txt.*{said}"):
            read_posed_sequence(tmp_path / "seq-01.zip")


def test_nearest_times_are_those_of_a_square_table() -> None:
    rng = np.random.default_rng(0)
    times = rng.integers(0, 60, 40) / 10.0  # unsorted, some twice
    wanted = rng.uniform(-1.0, 7.0, 300)
    distance = np.abs(times[_nearest(times, wanted)] - wanted)
    np.testing.assert_array_equal(distance, np.abs(times - wanted[:, None]).min(axis=1))


def test_tens_of_thousands_of_times_need_no_square_table() -> None:
    times = np.arange(60_000) / 30.0  # a square table of doubles would take 28.8 GB
    np.testing.assert_array_equal(_nearest(times, times + 0.01), np.arange(60_000))


@pytest.fixture
def umask_077() -> Iterator[None]:
    before = os.umask(0o077)
    yield
    os.umask(before)


@pytest.mark.usefixtures("umask_077")
def test_files_are_as_private_as_the_user_wants(tmp_path: Path) -> None:
    write_text(tmp_path / "file.txt", "text")
    with atomic_directory(tmp_path / "folder") as folder:
        (folder / "inner.txt").touch()
    modes = {path.name: path.stat().st_mode & 0o777 for path in tmp_path.rglob("*")}
    assert modes == {"file.txt": 0o600, "folder": 0o700, "inner.txt": 0o600}


def test_a_link_stays_one_and_what_it_leads_to_is_written(tmp_path: Path) -> None:
    target, link = tmp_path / "elsewhere" / "poses.csv", tmp_path / "link.csv"
    link.symlink_to(target)
    for text in ("first", "second"):
        write_text(link, text)
        assert link.is_symlink()
        assert target.read_text() == text
    assert [path.name for path in target.parent.iterdir()] == ["poses.csv"]
    (tmp_path / "empty").mkdir()
    (tmp_path / "folder").symlink_to("empty")
    with atomic_directory(tmp_path / "folder") as folder:
        (folder / "inner.txt").touch()
    assert (tmp_path / "empty" / "inner.txt").is_file()


def test_a_pipe_or_a_device_is_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    (tmp_path / "null").symlink_to("/dev/null")
    for path in (pipe, tmp_path / "null"):
        with pytest.raises(OSError, match="pipe or a device"), atomic_path(path):
            pass
    assert pipe.is_fifo()


def test_what_cannot_be_written_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    for name in ("notes.txt/x", "notes.txt/x/y", "loop", "loop/x", "x" * 300, "pipe"):
        with pytest.raises(InputError, match=r"choose another place with `out`$"):
            refuse_unwritable(tmp_path / name)
    with pytest.raises(InputError, match="cannot be written"):
        refuse_unwritable(Path("/proc/poses.csv"))
    refuse_unwritable(tmp_path / "new" / "deep" / "poses.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["loop", "notes.txt", "pipe"]


def test_poses_of_a_moving_camera_are_read_back(tmp_path: Path) -> None:
    (tmp_path / "pose.txt").write_text(pose_text(np.eye(4)).replace("\n", "\r\n"))
    np.testing.assert_array_equal(read_pose(tmp_path / "pose.txt"), np.eye(4))
