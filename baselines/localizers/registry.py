"""The localizers by the names that the configuration and the tables use."""

from __future__ import annotations

from collections.abc import Callable

from baselines.localizers.base import Localizer
from baselines.localizers.hourglass import Hourglass
from baselines.localizers.poselstm import PoseLstm
from baselines.localizers.posenet import PoseNet
from baselines.localizers.posenet2 import PoseNet2, PoseNet2ResNet
from synfeal.config.models import LocalizerConfig, NetworkConfig

LOCALIZERS: dict[str, Callable[[NetworkConfig, LocalizerConfig], Localizer]] = {
    "posenet": PoseNet,
    "poselstm": PoseLstm,
    "hourglass": Hourglass,
    "posenet2resnet": PoseNet2ResNet,
    "posenet2": PoseNet2,
}


def build_localizer(name: str, network: NetworkConfig, hyper: LocalizerConfig) -> Localizer:
    """A localizer of this shape, randomly initialised from torch's global generator."""
    return LOCALIZERS[name](network, hyper)
