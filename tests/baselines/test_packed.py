"""Data sets on disk: 7-Scenes files, packed frames, manifests, and what prepares a scene."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from baselines.training import data
from baselines.training.data import image_statistics, read_images
from synfeal.config.dataset import RenderConfig
from synfeal.dataset.packed import fit_frame, new_packed, pack_frames, write_packed
from synfeal.dataset.pose_table import write_pose_table
from synfeal.dataset.render_sequence import render_packed, render_sequence
from synfeal.mesh.save import save_glb
from synfeal.render.choose import BACKENDS
from tests.synfeal.test_dataset import CAMERA, ROOM, poses_of


@pytest.mark.parametrize("size", [(128, 96), (96, 128), (80, 60), (101, 77)])
def test_frames_are_resized_and_cropped_about_the_centre(size):
    rows, columns = np.indices((size[1], size[0]))
    ramp = np.stack([columns * 255 / size[0], rows * 255 / size[1], 0 * rows], axis=2)
    fitted = fit_frame(Image.fromarray(ramp.astype(np.uint8)), 32).astype(float)
    assert fitted.shape == (32, 32, 3)
    np.testing.assert_allclose(fitted[15:17, 15:17, :2].mean(axis=(0, 1)), 127, atol=6)
    visible = 32 / 33 * min(size) / size[0]  # share of the width left after the crop
    assert np.ptp(fitted[..., 0]) == pytest.approx(255 * visible, rel=0.07)


def test_frames_rendered_into_an_array_are_those_of_the_files(tmp_path):
    save_glb(tmp_path / "mesh.glb", ROOM)
    plan, bounds = poses_of(5), ((0, 3), (3, 5))
    shards = [tmp_path / f"seq-{number:02d}.npy" for number in (1, 2)]
    write_pose_table(tmp_path / "plan.csv", plan)
    for rows, shard in zip(bounds, shards, strict=True):
        given = tmp_path / "mesh.glb", CAMERA, tmp_path / "plan.csv", *rows
        render_packed(*given, 24, "square", RenderConfig(), shard)
        render_sequence(*given, False, RenderConfig(), shard.with_suffix(""))
    records = [shard.with_suffix(".json") for shard in shards]
    given = (tmp_path / "plan.csv", shards, records, CAMERA, RenderConfig(), "square")
    write_packed(*given, tmp_path / "train.npy")
    pack_frames([shard.with_suffix("") for shard in shards], 24, tmp_path / "files.npy")
    assert (tmp_path / "train.npy").read_bytes() == (tmp_path / "files.npy").read_bytes()
    record = json.loads((tmp_path / "train.json").read_text())
    assert (record["frames"], record["input_px"]) == (5, 24)
    assert [(s["name"], s["frames"]) for s in record["shards"]] == [("seq-01", 3), ("seq-02", 2)]
    assert {s["backend"] for s in record["shards"]} == {record["render"]["backend"]}
    assert record["render"]["backend"] in BACKENDS  # never "auto", which the settings said
    assert all(s["backend"] == "raycast" or s["gl_renderer"] for s in record["shards"])
    for name, file in (("sha256", "train.npy"), ("plan_sha256", "plan.csv")):
        assert record[name] == hashlib.sha256((tmp_path / file).read_bytes()).hexdigest()


N, PX = 30, 8
CPU = torch.device("cpu")


@pytest.fixture
def frames(tmp_path):
    path = tmp_path / "frames.npy"
    with new_packed(path, N, PX) as packed:
        packed[:] = np.random.default_rng(0).integers(0, 256, packed.shape)
    return path


def mapped(path):
    """Whether this process has the file in its memory map."""
    return str(path) in Path("/proc/self/maps").read_text(encoding="utf-8")


def test_a_large_set_is_mapped_and_holds_the_same_images(frames, monkeypatch):
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
