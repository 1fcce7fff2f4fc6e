"""Which backbone each localizer stands on; free of torch, so that a planner may import it."""

from __future__ import annotations

from typing import Literal

from synfeal.config.learning import NetworkConfig

BackboneName = Literal["googlenet", "inception_v3", "resnet34"]

RESNET_LOCALIZERS = frozenset({"hourglass", "posenet2resnet"})


def backbone_of(model: str, network: NetworkConfig) -> BackboneName:
    """The backbone of a localizer: ResNet-34, or the Inception network of the configuration."""
    return "resnet34" if model in RESNET_LOCALIZERS else network.backbone
