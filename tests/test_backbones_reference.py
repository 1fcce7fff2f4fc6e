"""The backbones beside torchvision's: with the same weights, the same maps."""

import importlib.util

import pytest
import torch
from torch import nn

from baselines.localizers.backbones.weights import (
    CLASSIFIERS,
    IMAGENET_FILES,
    build_backbone,
    load_backbone_weights,
)

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

all_backbones = pytest.mark.parametrize("name", LAYERS)


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
    """What the layers put out."""
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
    images = torch.randn(2, 3, 80, 80) if training else torch.randn(1, 3, PX[name], PX[name])
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
