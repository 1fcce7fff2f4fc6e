"""Cost of one image for a network, counted on tensors without data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.localizers.registry import BackboneName

if TYPE_CHECKING:
    from torch import nn

# Forward and backward: the gradients of inputs and of weights each cost one forward pass.
PASSES = 3
FLOAT_BYTES = 4
# Weights, gradients, and the two moments of AdamW.
PARAMETER_COPIES = 4


@dataclass(frozen=True)
class Work:
    """Cost of running a network on one image."""

    flop: float  # of one image forward; a multiply-add is two
    layers: int  # layers with weights
    parameter_bytes: float  # of its weights
    activation_bytes: float  # of what these layers put out for one image

    def size(self, samples: int, batch_size: int, predicted: int) -> tuple[float, float]:
        """Count layers times steps, and TFLOP, of training on ``samples`` and predicting frames."""
        steps = -(-samples // batch_size)
        images = PASSES * steps * batch_size + predicted
        return float(self.layers * steps), images * self.flop / 1e12

    def held_bytes(self, batch_size: int) -> float:
        """Return the memory of a training step, bytes."""
        return PARAMETER_COPIES * self.parameter_bytes + batch_size * self.activation_bytes


@lru_cache
def training_work(model: str, network: NetworkConfig, hyper: LocalizerConfig) -> Work:
    """Measure the network of a localizer."""
    from baselines.localizers.registry import build_localizer  # torch takes a second to load

    return _count(lambda: build_localizer(model, network, hyper), network.input_px)


@lru_cache
def pretext_work(backbone: BackboneName, network: NetworkConfig) -> Work:
    """Measure the network that a backbone is pretrained in."""
    from baselines.training.pretrain import RoomsNetwork

    return _count(lambda: RoomsNetwork(backbone, network.width, 1), network.input_px)


def _count(build: Callable[[], nn.Module], input_px: int) -> Work:
    """Pass one image without data through a network and note what every layer does."""
    import torch
    from torch.utils.flop_counter import FlopCounterMode

    outputs: list[int] = []

    def note(_: nn.Module, __: Any, out: Any) -> None:  # a recurrent layer: its sequence first
        outputs.append(int((out[0] if isinstance(out, tuple) else out).numel()))

    with torch.device("meta"):
        network = build().eval()
        image = torch.empty(1, 3, input_px, input_px)
    for layer in network.modules():
        if list(layer.parameters(recurse=False)) and not list(layer.children()):
            layer.register_forward_hook(note)
    with FlopCounterMode(display=False) as counter, torch.no_grad():
        network(image)
    parameters = sum(p.numel() for p in network.parameters())
    return Work(
        float(counter.get_total_flops()),
        len(outputs),
        float(FLOAT_BYTES * parameters),
        float(FLOAT_BYTES * sum(outputs)),
    )
