"""Memory of a training run, the only estimate of it: rules ask for it, plans print it.

Free of torch, so that a workflow may import it.
"""

from __future__ import annotations

from pathlib import Path

from baselines.config.learning import NetworkConfig

# The program and its libraries.
PROGRAM_MB = 1000.0
PACKED_MB_PER_PX = 3e-6  # three bytes
# Of Hourglass, the largest network. At 224 px it puts out 34 MB for an image and has 0.5 GB of
# parameters, which lie there four times, with gradients and two moments; the rest is margin.
LAYERS_MB_PER_PX = 1.2e-3
PARAMETERS_MB_PER_PX = 0.05


def training_mb(n_frames: int, network: NetworkConfig, batch_size: int) -> int:
    """Estimate the peak memory in MB of training any localizer.

    Frames are held as they are, packed; layers grow with the width, parameters with its square.

    Args:
        n_frames: Training and test frames.
        network: Shape of the localizers.
        batch_size: Images of a step.
    """
    layers = LAYERS_MB_PER_PX * batch_size * network.width
    parameters = PARAMETERS_MB_PER_PX * network.width**2
    per_px = PACKED_MB_PER_PX * n_frames + layers + parameters
    return round(PROGRAM_MB + network.input_px**2 * per_px)


def free_mb(meminfo: Path = Path("/proc/meminfo")) -> float | None:
    """Return the memory in MB that programs of this machine can still have, where it says so.

    Args:
        meminfo: Linux' list of its memory.
    """
    try:
        lines = meminfo.read_text().splitlines()
    except OSError:
        return None  # another system
    found = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    return int(found[0]) * 1024 / 1e6 if found else None
