"""Shares of a GPU that jobs ask for, so that as many run on one card as it bears.

Free of torch, so that a workflow may import it.
"""

from __future__ import annotations

import math
import subprocess
from pathlib import Path

from baselines.config.learning import NetworkConfig
from baselines.training.memory import training_mb

WHOLE = 100
# Two runs of PoseNet2 (224 px, full width, batch 45) on one card learn from 1.3 times as many
# images a second as one, four from no more than one (results/benchmarks/gpu.csv). A captured step
# leaves a card little time: kernels fill 13.7 of its 14.4 ms.
RUNS_ON_A_CARD = 2
# As many drew side by side, 8,500 frames of 320 x 240 in 17 s, on a card of 141 GB.
RENDERERS_ON_A_CARD = 14
# Mesh and textures of the largest scene, frames, and what a driver keeps for a process.
RENDERER_MB = 1500.0
MIB_IN_MB = 1.048576


def card_mb(program: str | Path = "nvidia-smi") -> float | None:
    """Return the memory in MB of this machine's first GPU; None where there is none.

    Args:
        program: Tool of NVIDIA's driver.
    """
    command = [program, "--query-gpu=memory.total", "--format=csv,noheader,nounits"]
    try:
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        return float(said.partition("\n")[0]) * MIB_IN_MB
    except (OSError, ValueError, subprocess.CalledProcessError):
        return None  # no driver, or one that does not say


def training_percent(
    n_frames: int, network: NetworkConfig, batch_size: int, card: float | None
) -> int:
    """Return the share of a card that a training run asks for, percent.

    It is the larger of the shares of its memory and of its time.

    Args:
        n_frames: Training and test frames.
        network: Shape of the localizers.
        batch_size: Images of a step.
        card: Memory of the card, MB; None without one, whose share is 0.
    """
    needed_mb = training_mb(n_frames, network, batch_size)
    return _percent(needed_mb, RUNS_ON_A_CARD, card)


def rendering_percent(card: float | None) -> int:
    """Return the share of a card that a job which draws asks for, percent.

    Args:
        card: Memory of the card, MB; None without one, whose share is 0.
    """
    return _percent(RENDERER_MB, RENDERERS_ON_A_CARD, card)


def _percent(needed_mb: float, most: int, card: float | None) -> int:
    if card is None:
        return 0
    return min(WHOLE, max(WHOLE // most, math.ceil(WHOLE * needed_mb / card)))
