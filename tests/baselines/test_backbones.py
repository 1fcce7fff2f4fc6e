"""Backbones: the official ImageNet files, torchvision's maps with the same weights, and loading."""

import importlib.util
import io
import urllib.error

import pytest
import torch
from torch import nn

from baselines.config.learning import INCEPTION_V3_MIN_PX
from baselines.localizers.backbones import weights
from baselines.localizers.backbones.googlenet import ConvBn
from baselines.localizers.backbones.shipped import BACKBONES, ship, shipped_weights_path
from baselines.localizers.backbones.weights import (
    CLASSIFIERS,
    IMAGENET_FILES,
    build_backbone,
    imagenet_weights_path,
    load_backbone_weights,
)
from baselines.training.pretrain import RoomsNetwork
from synfeal.errors import InputError

all_backbones = pytest.mark.parametrize("name", IMAGENET_FILES)


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


@pytest.mark.parametrize(
    ("side", "kernel", "stride", "padded", "expected"),
    [(8, 3, 2, False, 3), (8, 3, 1, False, 6), (9, 3, 2, False, 4), (9, 3, 2, True, 5)],
)
def test_convolutions_without_padding_lose_a_margin(side, kernel, stride, padded, expected):
    layer = ConvBn(1, 2, kernel, stride, padded)
    assert layer(torch.zeros(2, 1, side, side)).shape == (2, 2, expected, expected)
    # As the docstring says it: padded S / stride, else (S - kernel + 1) / stride, rounded up.
    assert expected == -(-(side if padded else side - kernel + 1) // stride)


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


@pytest.mark.parametrize(
    "error", [torch.OutOfMemoryError("full"), AttributeError("ours")], ids=["memory", "fault"]
)
@pytest.mark.parametrize("place", [(torch, "load"), (torch.nn.Module, "load_state_dict")])
def test_neither_memory_nor_a_fault_is_blamed_on_the_weights(place, error, tmp_path, monkeypatch):
    backbone = build_backbone("resnet34", 0.125)
    torch.save(backbone.state_dict(), tmp_path / "backbone.pt")

    def fail(*args, **kwargs):
        raise error

    monkeypatch.setattr(*place, fail)
    with pytest.raises(type(error)):
        load_backbone_weights(backbone, tmp_path / "backbone.pt")


@all_backbones
def test_without_a_network_the_message_says_where_to_put_the_file(name, tmp_path, monkeypatch):
    def refuse(url, timeout):
        raise urllib.error.URLError("no route to host")

    monkeypatch.setattr(weights.urllib.request, "urlopen", refuse)
    with pytest.raises(InputError) as caught:
        imagenet_weights_path(name, tmp_path)
    message, file = str(caught.value), IMAGENET_FILES[name]
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


# What torchvision's layers of these names put out, ours return in this order.
LAYERS = {
    "googlenet": ("inception4a", "inception4d", "inception5b"),
    "inception_v3": ("Mixed_5d", "Mixed_6e", "Mixed_7c"),
    "resnet34": ("layer1", "layer2", "layer3", "layer4"),
}
PX = {"googlenet": 224, "inception_v3": 299, "resnet34": 224}
# With the classifiers of the official files, and with what these files do to their images.
INCEPTION = {"aux_logits": True, "transform_input": True, "init_weights": False}
ARGUMENTS = {"googlenet": INCEPTION, "inception_v3": INCEPTION, "resnet34": {}}
TITLES = {"googlenet": "GoogLeNet", "inception_v3": "Inception_V3", "resnet34": "ResNet34"}
# Operators that torchvision describes as it is imported; no backbone calls them.
MISSING = ("nms", "qnms")


@pytest.fixture(scope="module")
def models():
    """``torchvision.models``.

    Wheels of torchvision are built for torch with CUDA. Beside torch without it their operators
    cannot be loaded, and the import fails; it succeeds where these are at least declared.
    """
    if importlib.util.find_spec("torchvision") is None:
        pytest.skip("torchvision is not installed")
    library = None
    try:
        found = importlib.import_module("torchvision.models")
    except RuntimeError:
        library = torch.library.Library("torchvision", "DEF")
        for operator in MISSING:
            library.define(f"{operator}(Tensor dets, Tensor scores, float threshold) -> Tensor")
        found = importlib.import_module("torchvision.models")
    yield found
    del library


@pytest.fixture(autouse=True)
def _one_thread_and_seed():
    torch.set_num_threads(1)
    torch.manual_seed(0)


def reference(models, name):
    """torchvision's network; its batch normalisations do something."""
    network = getattr(models, name)(weights=None, **ARGUMENTS[name])
    for module in network.modules():
        if isinstance(module, nn.BatchNorm2d):
            nn.init.uniform_(module.weight, 0.5, 1.5)
            nn.init.normal_(module.bias, std=0.1)
            nn.init.normal_(module.running_mean, std=0.1)
            nn.init.uniform_(module.running_var, 0.1, 0.5)
    return network


def outputs(network, layers, images):
    """Return the outputs of the layers."""
    found = {}
    for layer in layers:
        hook = lambda _, __, out, layer=layer: found.update({layer: out.clone()})  # noqa: E731
        network.get_submodule(layer).register_forward_hook(hook)
    network(images)
    return [found[layer] for layer in layers]


@torch.no_grad()
@all_backbones
@pytest.mark.parametrize("training", [False, True], ids=["evaluation", "training"])
def test_maps_are_those_of_torchvision(models, name, training, tmp_path):
    expected = reference(models, name).train(training)
    torch.save(expected.state_dict(), tmp_path / "official.pth")
    backbone = build_backbone(name, 1.0).train(training)
    load_backbone_weights(backbone, tmp_path / "official.pth")
    if name == "inception_v3":
        expected.AuxLogits = None  # as large as its images must be for it
    # In double precision: joined convolutions add in another order than torchvision's.
    expected, backbone = expected.double(), backbone.double()
    size = (4, 3, 128, 128) if training else (1, 3, PX[name], PX[name])
    images = torch.randn(size, dtype=torch.float64)
    wanted = outputs(expected, LAYERS[name], images)
    for found, right in zip(backbone(images), wanted, strict=True):
        assert found.shape == right.shape
        assert (found - right).abs().max() <= 1e-5 * right.abs().max()
    state = {k: v for k, v in expected.state_dict().items() if not k.startswith(CLASSIFIERS)}
    assert backbone.state_dict().keys() == state.keys()
    for key, value in backbone.state_dict().items():  # the running statistics moved alike
        torch.testing.assert_close(value, state[key], rtol=1e-4, atol=1e-5)


@all_backbones
def test_the_file_is_the_one_torchvision_downloads(models, name):
    url = getattr(models, f"{TITLES[name]}_Weights").IMAGENET1K_V1.url
    assert url.rsplit("/", 1)[1] == IMAGENET_FILES[name]
