"""Data sets that are too large for memory are read from the disk as they are needed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from baselines.training import data
from baselines.training.data import image_statistics, read_images
from synfeal.dataset.packed import join_packed, new_packed, read_packed

N, PX = 30, 8
CPU = torch.device("cpu")


@pytest.fixture
def frames(tmp_path: Path) -> Path:
    path = tmp_path / "frames.npy"
    with new_packed(path, N, PX) as packed:
        packed[:] = np.random.default_rng(0).integers(0, 256, packed.shape)
    return path


def mapped(path: Path) -> bool:
    """Whether this process has the file in its memory map."""
    return str(path) in Path("/proc/self/maps").read_text(encoding="utf-8")


def test_a_large_set_is_mapped_and_holds_the_same_images(
    frames: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = read_images(frames, N - 3, PX, CPU)
    assert not mapped(frames)
    monkeypatch.setattr(data, "MOST_READ_BYTES", 100)
    images = read_images(frames, N - 3, PX, CPU)
    assert mapped(frames)
    assert images.shape == (N - 3, 3, PX, PX)
    assert images.stride() == read.stride()
    assert torch.equal(images, read)
    assert torch.equal(image_statistics(images).mean, image_statistics(read).mean)
    before = frames.read_bytes()
    images[5] = 0  # of this process alone
    assert frames.read_bytes() == before
    assert torch.equal(read_images(frames, N, PX, CPU)[:4], read[:4])


def test_joined_frames_are_those_of_numpy_to_the_byte(frames: Path, tmp_path: Path) -> None:
    content = read_packed(frames)
    for name, part in (("a", content[:7]), ("b", content[7:])):
        np.save(tmp_path / f"{name}.npy", part)
    joined = tmp_path / "joined.npy"
    join_packed([tmp_path / "a.npy", tmp_path / "b.npy"], joined)
    assert joined.read_bytes() == frames.read_bytes()
    np.testing.assert_array_equal(np.load(joined), content)
