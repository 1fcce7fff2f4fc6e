"""Backbones by name, and the weights they start from."""

from __future__ import annotations

import hashlib
import urllib.request
from pathlib import Path

import safetensors.torch
from safetensors import SafetensorError
from torch import nn

from baselines.config.learning import InceptionName
from baselines.localizers.backbones.googlenet import GoogLeNet, InceptionBackbone
from baselines.localizers.backbones.inception_v3 import InceptionV3
from baselines.localizers.backbones.resnet import ResNet34
from baselines.localizers.memory import is_out_of_memory
from baselines.localizers.registry import BackboneName
from baselines.localizers.saved import checked_state, load_saved
from synfeal.errors import InputError, read_as, why
from synfeal.records.files import atomic_path

Backbone = InceptionBackbone | ResNet34

URL = "https://download.pytorch.org/models"
# The eight digits are the beginning of each file's SHA-256.
IMAGENET_FILES: dict[BackboneName, str] = {
    "googlenet": "googlenet-1378be20.pth",
    "inception_v3": "inception_v3_google-0cc3c7bd.pth",
    "resnet34": "resnet34-b627a593.pth",
}
# Classifiers of the ImageNet networks, which no localizer has.
CLASSIFIERS = ("fc.", "aux1.", "aux2.", "AuxLogits.")


def build_inception(name: InceptionName, width: float) -> InceptionBackbone:
    """Build the backbone of PoseNet, PoseLSTM and PoseNet2, randomly initialised."""
    return GoogLeNet(width) if name == "googlenet" else InceptionV3(width)


def build_backbone(name: BackboneName, width: float) -> Backbone:
    """Build a backbone without its classifier, randomly initialised."""
    return ResNet34(width) if name == "resnet34" else build_inception(name, width)


def imagenet_weights_path(name: BackboneName, weights_dir: Path) -> Path:
    """Return the file of the official ImageNet weights; download and check it if it is missing.

    Raises:
        InputError: the file cannot be downloaded, or is not the one its name promises.
    """
    path = weights_dir / IMAGENET_FILES[name]
    if not path.exists():
        _download(f"{URL}/{path.name}", path)
    return path


def load_backbone_weights(backbone: nn.Module, path: Path) -> None:
    """Load a state dict into a backbone; every parameter of it must be in the file.

    Raises:
        InputError: the file cannot be read as a state dict, or belongs to another shape of network.
    """
    with read_as(path, "backbone weights", OSError, ValueError, SafetensorError):
        if path.suffix == ".safetensors":
            state = safetensors.torch.load_file(path)
        else:
            state = checked_state(load_saved(path))
    state = {name: value for name, value in state.items() if not name.startswith(CLASSIFIERS)}
    try:
        backbone.load_state_dict(state)
    except RuntimeError as error:
        if is_out_of_memory(error):
            raise
        unfit = str(error).splitlines()[1].strip()
        raise InputError(
            path,
            f"does not fit {type(backbone).__name__} of this network.width ({unfit})",
            "train the backbone again, or set the width it was trained with",
        ) from error


def _download(url: str, path: Path) -> None:
    expected = path.stem.rsplit("-", 1)[1]
    try:
        with urllib.request.urlopen(url, timeout=30) as response:
            content = response.read()
    except OSError as error:
        raise InputError(
            path,
            f"ImageNet weights are missing and {url} cannot be downloaded ({why(error)})",
            f"fetch it on a machine with a network and put it at {path}",
        ) from error
    found = hashlib.sha256(content).hexdigest()
    if not found.startswith(expected):
        raise InputError(
            path,
            f"{url} answered with another file (SHA-256 begins {found[:8]}, expected {expected})",
            "try again, or put the right file there",
        )
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)
