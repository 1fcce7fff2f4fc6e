"""Memory a training run asks a cluster for; free of torch, so that a workflow may import it."""

from __future__ import annotations

from synfeal.config.learning import NetworkConfig

# The program and its libraries.
PROGRAM_MB = 1000.0
PACKED_MB_PER_PX = 3e-6  # three bytes
# Of Hourglass, the largest network. At 224 px it puts out 34 MB for an image and has 0.5 GB of
# parameters, which lie there four times, with gradients and two moments; the rest is margin.
LAYERS_MB_PER_PX = 1.2e-3
PARAMETERS_MB_PER_PX = 0.05


def training_mb(n_frames: int, network: NetworkConfig, batch_size: int) -> int:
    """Most memory that training any localizer takes, in MB.

    Args:
        n_frames: training and test frames, which are held as they are, packed.
        network: size of an image, and width, by which layers grow and parameters quadratically.
        batch_size: images of a step.
    """
    layers = LAYERS_MB_PER_PX * batch_size * network.width
    parameters = PARAMETERS_MB_PER_PX * network.width**2
    per_px = PACKED_MB_PER_PX * n_frames + layers + parameters
    return round(PROGRAM_MB + network.input_px**2 * per_px)
