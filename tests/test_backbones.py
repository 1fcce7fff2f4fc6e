"""Backbones: the layout of the official ImageNet files, shapes, and loading of weights."""

import io
import urllib.error

import pytest
import torch

from baselines.localizers.backbones import weights
from baselines.localizers.backbones.shipped import BACKBONES, ship, shipped_weights_path
from baselines.localizers.backbones.weights import (
    build_backbone,
    imagenet_weights_path,
    load_backbone_weights,
)
from baselines.training.pretrain import RoomsNetwork
from synfeal.config.learning import INCEPTION_V3_MIN_PX
from synfeal.errors import InputError

all_backbones = pytest.mark.parametrize("name", weights.IMAGENET_FILES)


@torch.no_grad()
@pytest.mark.parametrize(
    ("name", "input_px", "side"),
    [("googlenet", 33, 1), ("resnet34", 33, 2), ("inception_v3", INCEPTION_V3_MIN_PX, 1)],
)
def test_narrow_backbones_run_at_any_size_from_the_least_on(name, input_px, side):
    backbone = build_backbone(name, 0.125).eval()
    *_, last = backbone(torch.zeros(2, 3, input_px, input_px))
    assert last.shape == (2, backbone.n_out, side, side)
    if name == "inception_v3":
        with pytest.raises(RuntimeError, match=r"too small|greater than"):
            backbone(torch.zeros(1, 3, input_px - 1, input_px - 1))


def test_weights_of_another_width_or_hash_are_refused(tmp_path, monkeypatch):
    torch.save(build_backbone("resnet34", 0.125).state_dict(), tmp_path / "narrow.pt")
    with pytest.raises(InputError, match=r"narrow\.pt: does not fit ResNet34.*width"):
        load_backbone_weights(build_backbone("resnet34", 0.25), tmp_path / "narrow.pt")
    monkeypatch.setattr(
        weights.urllib.request, "urlopen", lambda url, timeout: io.BytesIO(b"a login page")
    )
    with pytest.raises(InputError, match="expected b627a593"):
        imagenet_weights_path("resnet34", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["narrow.pt"]


@all_backbones
def test_without_a_network_the_message_says_where_to_put_the_file(name, tmp_path, monkeypatch):
    def refuse(url, timeout):
        raise urllib.error.URLError("no route to host")

    monkeypatch.setattr(weights.urllib.request, "urlopen", refuse)
    with pytest.raises(InputError) as caught:
        imagenet_weights_path(name, tmp_path)
    message, file = str(caught.value), weights.IMAGENET_FILES[name]
    assert "no route to host" in message
    assert f"put it at {tmp_path / file}" in message
    assert f"https://download.pytorch.org/models/{file}" in message
    assert "\n" not in message
    assert list(tmp_path.iterdir()) == []


@all_backbones
def test_every_backbone_learns_rooms_each_with_a_regressor_of_its_own(name):
    network = RoomsNetwork(name, 0.125, 3)
    features = network(torch.randn(4, 3, 80, 80))
    poses = network.heads(features, torch.tensor([0, 2, 2, 0]))
    (poses.position_m.sum() + poses.quat_wxyz.sum()).backward()
    assert all(p.grad is not None for p in network.backbone.parameters())
    used = network.heads.poses.weight.grad.view(3, 7, -1).abs().amax((1, 2)) > 0
    assert used.tolist() == [True, False, True]


def test_shipped_weights_are_those_that_were_trained_to_half_a_precision(tmp_path):
    results, directory = tmp_path / "results", tmp_path / "shipped"
    trained = {name: build_backbone(name, 0.125) for name in BACKBONES}
    (results / "pretrained").mkdir(parents=True)
    directory.mkdir()
    for name, backbone in trained.items():
        torch.save(backbone.state_dict(), results / "pretrained" / f"{name}.pt")
    ship(results, directory)
    for name, backbone in trained.items():
        loaded = build_backbone(name, 0.125)
        load_backbone_weights(loaded, shipped_weights_path(name, directory))
        for key, value in loaded.state_dict().items():
            torch.testing.assert_close(value, backbone.state_dict()[key], rtol=1e-3, atol=1e-4)
    with pytest.raises(InputError, match=r"inception_v3 are shipped.*choose googlenet"):
        shipped_weights_path("inception_v3", directory)
    file = directory / "googlenet.safetensors"
    file.write_bytes(file.read_bytes()[:-1] + b"x")
    with pytest.raises(InputError, match=r"googlenet\.safetensors: is not the file"):
        shipped_weights_path("googlenet", directory)
