"""Trained localizers on disk: weights, and the image statistics they were trained with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from baselines.localizers.base import Localizer
from baselines.training.data import ImageStatistics
from synfeal.errors import InputError
from synfeal.files import atomic_path


def save_atomically(path: Path, value: Any) -> None:
    """``torch.save`` to a temporary name, then rename."""
    with atomic_path(path) as temporary:
        torch.save(value, temporary)


def save_checkpoint(path: Path, localizer: Localizer, statistics: ImageStatistics) -> None:
    """Write everything prediction needs beside the configuration."""
    state = {name: value.detach().cpu() for name, value in localizer.state_dict().items()}
    statistic = {"mean": statistics.mean.cpu(), "deviation": statistics.deviation.cpu()}
    save_atomically(path, {"localizer": state, "images": statistic})


def load_checkpoint(path: Path, localizer: Localizer, device: torch.device) -> ImageStatistics:
    """Load weights into a localizer on ``device`` and return its image statistics.

    Raises:
        InputError: the file cannot be read, or belongs to another localizer or network shape.
    """
    try:
        checkpoint = torch.load(path, map_location=device, weights_only=True)
        localizer.load_state_dict(checkpoint["localizer"])
        found = ImageStatistics(**checkpoint["images"])
        for value in (found.mean, found.deviation):
            if value.shape != (1, 3, 1, 1) or not value.isfinite().all():
                raise ValueError("its image statistics are damaged")
        return found
    except Exception as error:  # torch.load raises whatever the broken file provokes
        reason = str(error)[:200]
        message = f"{path}: is no checkpoint of {type(localizer).__name__} at this network shape"
        raise InputError(f"{message} ({reason}); train it again") from None
