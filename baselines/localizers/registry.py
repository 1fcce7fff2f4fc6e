"""Build localizers by name; torch is loaded when one is built."""

from __future__ import annotations

from pkgutil import resolve_name
from typing import TYPE_CHECKING, Literal

from baselines.config.learning import LOCALIZERS, LocalizerConfig, NetworkConfig

if TYPE_CHECKING:
    from baselines.localizers.base import Localizer

BackboneName = Literal["googlenet", "inception_v3", "resnet34"]


def backbone_of(model: str, network: NetworkConfig) -> BackboneName:
    """Return the backbone of a localizer: its own, or the Inception network of the configuration.

    Args:
        model: Name of the localizer.
        network: Shape of all localizers.
    """
    return LOCALIZERS[model].backbone or network.backbone


def build_localizer(name: str, network: NetworkConfig, hyper: LocalizerConfig) -> Localizer:
    """Build a localizer, randomly initialised from torch's global generator.

    Args:
        name: Name of the localizer.
        network: Shape of all localizers.
        hyper: Its hyper-parameters.

    Raises:
        InputError: A hyper-parameter that it needs is not given.
    """
    localizer: Localizer = resolve_name(LOCALIZERS[name].place)(network, hyper)
    return localizer
