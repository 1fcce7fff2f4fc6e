"""Backbones: the layout of the official ImageNet files, shapes, and loading of weights."""

from __future__ import annotations

import io
import urllib.error

import pytest
import torch

from baselines.localizers.backbones import weights
from baselines.localizers.backbones.channels import scaled_channels
from baselines.localizers.backbones.googlenet import GoogLeNet
from baselines.localizers.backbones.inception_v3 import InceptionV3
from baselines.localizers.backbones.resnet import ResNet34
from baselines.localizers.backbones.shipped import BACKBONES, ship, shipped_weights_path
from baselines.localizers.backbones.weights import (
    build_backbone,
    imagenet_weights_path,
    load_backbone_weights,
)
from baselines.localizers.names import backbone_of
from baselines.training.pretrain import RoomsNetwork
from synfeal.config.learning import INCEPTION_V3_MIN_PX
from synfeal.config.models import MODELS, NetworkConfig
from synfeal.errors import InputError

Shapes = dict[str, tuple[int, ...]]

all_backbones = pytest.mark.parametrize("name", weights.IMAGENET_FILES)


def batch_norm(name: str, channels: int) -> Shapes:
    """Entries of one batch normalisation."""
    vectors = ("weight", "bias", "running_mean", "running_var")
    return {f"{name}.{v}": (channels,) for v in vectors} | {f"{name}.num_batches_tracked": ()}


def conv_bn(name: str, n_in: int, n_out: int, kernel: int) -> Shapes:
    """Entries of GoogLeNet's convolution with batch normalisation."""
    return {f"{name}.conv.weight": (n_out, n_in, kernel, kernel)} | batch_norm(f"{name}.bn", n_out)


def inception(name: str, n_in: int, *n: int) -> Shapes:
    """Entries of one inception block as torchvision names them."""
    return (
        conv_bn(f"{name}.branch1", n_in, n[0], 1)
        | conv_bn(f"{name}.branch2.0", n_in, n[1], 1)
        | conv_bn(f"{name}.branch2.1", n[1], n[2], 3)
        | conv_bn(f"{name}.branch3.0", n_in, n[3], 1)
        | conv_bn(f"{name}.branch3.1", n[3], n[4], 3)
        | conv_bn(f"{name}.branch4.1", n_in, n[5], 1)
    )


def official_googlenet() -> Shapes:
    """What googlenet-1378be20.pth holds, without its classifiers."""
    return (
        conv_bn("conv1", 3, 64, 7)
        | conv_bn("conv2", 64, 64, 1)
        | conv_bn("conv3", 64, 192, 3)
        | inception("inception3a", 192, 64, 96, 128, 16, 32, 32)
        | inception("inception3b", 256, 128, 128, 192, 32, 96, 64)
        | inception("inception4a", 480, 192, 96, 208, 16, 48, 64)
        | inception("inception4b", 512, 160, 112, 224, 24, 64, 64)
        | inception("inception4c", 512, 128, 128, 256, 24, 64, 64)
        | inception("inception4d", 512, 112, 144, 288, 32, 64, 64)
        | inception("inception4e", 528, 256, 160, 320, 32, 128, 128)
        | inception("inception5a", 832, 256, 160, 320, 32, 128, 128)
        | inception("inception5b", 832, 384, 192, 384, 48, 128, 128)
    )


def official_resnet34() -> Shapes:
    """What resnet34-b627a593.pth holds, without its classifier."""
    shapes: Shapes = {"conv1.weight": (64, 3, 7, 7)} | batch_norm("bn1", 64)
    n_in = 64
    for stage, (blocks, n) in enumerate([(3, 64), (4, 128), (6, 256), (3, 512)], start=1):
        for i in range(blocks):
            name = f"layer{stage}.{i}"
            shapes |= {f"{name}.conv1.weight": (n, n_in, 3, 3)} | batch_norm(f"{name}.bn1", n)
            shapes |= {f"{name}.conv2.weight": (n, n, 3, 3)} | batch_norm(f"{name}.bn2", n)
            if n_in != n:
                shapes |= {f"{name}.downsample.0.weight": (n, n_in, 1, 1)}
                shapes |= batch_norm(f"{name}.downsample.1", n)
            n_in = n
    return shapes


@pytest.mark.parametrize(
    ("backbone", "official"),
    [(GoogLeNet, official_googlenet()), (ResNet34, official_resnet34())],
)
def test_names_and_shapes_are_those_of_the_official_weights(backbone, official):
    found = {name: tuple(value.shape) for name, value in backbone().state_dict().items()}
    assert found == official


@pytest.mark.parametrize(
    ("name", "n_features", "total"),
    [
        ("googlenet", 1024, 6_624_904),
        ("inception_v3", 2048, 27_161_264 - 3_326_696),  # less its auxiliary classifier
        ("resnet34", 512, 21_797_672),
    ],
)
def test_parameter_count_is_the_published_one(name, n_features, total):
    classifier = n_features * 1000 + 1000
    assert sum(p.numel() for p in build_backbone(name, 1.0).parameters()) + classifier == total


def test_googlenet_maps_have_the_papers_strides_and_channels():
    maps = GoogLeNet().eval()(torch.zeros(1, 3, 224, 224))
    assert [tuple(m.shape) for m in maps] == [
        (1, 512, 14, 14),
        (1, 528, 14, 14),
        (1, 1024, 7, 7),
    ]


def test_inception_v3_maps_have_the_papers_sides_and_channels():
    """Table 1 of the paper."""
    with torch.device("meta"):
        maps = InceptionV3().eval()(torch.zeros(1, 3, 299, 299))
    assert [tuple(m.shape)[1:] for m in maps] == [(288, 35, 35), (768, 17, 17), (2048, 8, 8)]


@torch.no_grad()
def test_the_least_image_of_inception_v3_leaves_one_pixel():
    backbone = InceptionV3(0.125).eval()
    px = INCEPTION_V3_MIN_PX
    assert backbone(torch.zeros(1, 3, px, px)).last.shape[2:] == (1, 1)
    with pytest.raises(RuntimeError, match=r"too small|greater than"):
        backbone(torch.zeros(1, 3, px - 1, px - 1))


def test_resnet_maps_have_the_papers_strides_and_channels():
    maps = ResNet34().eval()(torch.zeros(1, 3, 224, 224))
    assert [tuple(m.shape)[1:] for m in maps] == [
        (64, 56, 56),
        (128, 28, 28),
        (256, 14, 14),
        (512, 7, 7),
    ]


@pytest.mark.parametrize("name", ["googlenet", "inception_v3"])
def test_inception_networks_see_images_scaled_to_minus_one_to_one(name):
    """Their official weights were trained so, and callers normalise with mean and deviation."""
    backbone = build_backbone(name, 0.125)
    grey = torch.rand(1, 3, 8, 8)
    mean = torch.tensor([0.485, 0.456, 0.406]).view(1, 3, 1, 1)
    deviation = torch.tensor([0.229, 0.224, 0.225]).view(1, 3, 1, 1)
    seen = (grey - mean) / deviation * backbone.input_scale + backbone.input_shift
    torch.testing.assert_close(seen, 2 * grey - 1)


@pytest.mark.parametrize("channels", [16, 64, 208, 528, 1024])
def test_scaled_channels(channels):
    assert scaled_channels(channels, 1.0) == channels
    quarter = scaled_channels(channels, 0.25)
    assert quarter % 8 == 0
    assert abs(quarter - channels / 4) <= 4


@pytest.mark.parametrize(
    ("name", "input_px", "side"),
    [
        *[(name, *size) for name in ("googlenet", "resnet34") for size in ((64, 2), (96, 3))],
        ("googlenet", 33, 1),
        ("resnet34", 33, 2),
        ("inception_v3", 96, 1),
        ("inception_v3", 128, 2),
    ],
)
def test_narrow_backbones_run_at_any_size(name, input_px, side):
    backbone = build_backbone(name, 0.125).eval()
    last = backbone(torch.zeros(2, 3, input_px, input_px))[-1]
    assert last.shape == (2, backbone.n_out, side, side)


@pytest.mark.parametrize("name", ["googlenet", "inception_v3"])
def test_auxiliary_maps_have_the_channels_named(name):
    backbone = build_backbone(name, 0.125).eval()
    maps = backbone(torch.zeros(1, 3, 80, 80))
    assert (maps.auxiliary1.shape[1], maps.auxiliary2.shape[1]) == backbone.n_aux


@all_backbones
def test_weights_with_classifiers_load_and_are_equal(name, tmp_path):
    source, target = build_backbone(name, 0.125), build_backbone(name, 0.125)
    state = dict(source.state_dict())
    state |= {k: torch.zeros(1) for k in ("fc.weight", "aux1.fc1.weight", "AuxLogits.fc.weight")}
    torch.save(state, tmp_path / "weights.pth")
    load_backbone_weights(target, tmp_path / "weights.pth")
    for loaded, expected in zip(
        target.state_dict().values(), source.state_dict().values(), strict=True
    ):
        assert torch.equal(loaded, expected)


def test_weights_of_another_width_are_refused(tmp_path):
    torch.save(build_backbone("resnet34", 0.125).state_dict(), tmp_path / "narrow.pt")
    with pytest.raises(InputError, match=r"narrow\.pt: does not fit ResNet34.*width"):
        load_backbone_weights(build_backbone("resnet34", 0.25), tmp_path / "narrow.pt")


def test_a_file_that_is_no_weights_is_refused(tmp_path):
    (tmp_path / "broken.pt").write_bytes(b"not weights")
    with pytest.raises(InputError, match=r"broken\.pt: cannot be read"):
        load_backbone_weights(build_backbone("resnet34", 0.125), tmp_path / "broken.pt")


@all_backbones
def test_without_a_network_the_message_says_where_to_put_the_file(name, tmp_path, monkeypatch):
    def refuse(url: str, timeout: float) -> None:
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


def test_a_download_with_another_hash_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(
        weights.urllib.request, "urlopen", lambda url, timeout: io.BytesIO(b"a login page")
    )
    with pytest.raises(InputError, match="expected b627a593"):
        imagenet_weights_path("resnet34", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_weights_that_are_there_are_not_downloaded(tmp_path, monkeypatch):
    monkeypatch.setattr(weights.urllib.request, "urlopen", None)
    path = tmp_path / "resnet34-b627a593.pth"
    path.touch()
    assert imagenet_weights_path("resnet34", tmp_path) == path


@all_backbones
def test_every_backbone_learns_rooms_each_with_a_regressor_of_its_own(name):
    network = RoomsNetwork(name, 0.125, 3)
    features = network(torch.randn(4, 3, 80, 80))
    poses = network.heads(features, torch.tensor([0, 2, 2, 0]))
    (poses.position_m.sum() + poses.quat_wxyz.sum()).backward()
    assert all(p.grad is not None for p in network.backbone.parameters())
    used = network.heads.poses.weight.grad.view(3, 7, -1).abs().amax((1, 2)) > 0
    assert used.tolist() == [True, False, True]


def test_every_backbone_is_one_of_a_localizer():
    networks = [NetworkConfig(backbone=name) for name in ("googlenet", "inception_v3")]
    named = {backbone_of(model, network) for model in MODELS for network in networks}
    assert named == set(weights.IMAGENET_FILES)


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
