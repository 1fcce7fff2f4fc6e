"""The localizers by name, and their backbones; torch is loaded when one is built."""

from __future__ import annotations

from pkgutil import resolve_name
from typing import TYPE_CHECKING, Literal

from baselines.config.learning import LocalizerConfig, NetworkConfig

if TYPE_CHECKING:
    from baselines.localizers.base import Localizer

BackboneName = Literal["googlenet", "inception_v3", "resnet34"]

# The class of each, ``module:name``.
LOCALIZERS = {
    "posenet": "baselines.localizers.posenet:PoseNet",
    "poselstm": "baselines.localizers.poselstm:PoseLstm",
    "hourglass": "baselines.localizers.hourglass:Hourglass",
    "posenet2resnet": "baselines.localizers.posenet2:PoseNet2ResNet",
    "posenet2": "baselines.localizers.posenet2:PoseNet2",
}
RESNET_LOCALIZERS = frozenset({"hourglass", "posenet2resnet"})


def backbone_of(model: str, network: NetworkConfig) -> BackboneName:
    """The backbone of a localizer: ResNet-34, or the Inception network of the configuration."""
    return "resnet34" if model in RESNET_LOCALIZERS else network.backbone


def build_localizer(name: str, network: NetworkConfig, hyper: LocalizerConfig) -> Localizer:
    """A localizer of this shape, randomly initialised from torch's global generator."""
    localizer: Localizer = resolve_name(LOCALIZERS[name])(network, hyper)
    return localizer
