"""Frames and poses on the device, where a whole set fits: no loader processes, no decoding."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from synfeal.dataset.packed import read_packed
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError

# Frames per step when statistics of a whole set are computed.
CHUNK = 500


@dataclass(frozen=True)
class ImageStatistics:
    """Mean and standard deviation (1, 3, 1, 1) of a training set's channels, in grey levels."""

    mean: Tensor
    deviation: Tensor

    def normalise(self, images: Tensor) -> Tensor:
        """Float images (B, 3, H, W) of uint8 ones; the memory layout is kept."""
        return (images.float() - self.mean).div_(self.deviation)


@dataclass(frozen=True)
class LabelledFrames:
    """A split on the device.

    Attributes:
        images: (N, 3, H, W) uint8, channels last in memory.
        position_m: (N, 3) float32.
        quat_wxyz: (N, 4) float32, unit length.
    """

    images: Tensor
    position_m: Tensor
    quat_wxyz: Tensor

    def __len__(self) -> int:
        return len(self.images)


def read_images(path: Path, count: int, input_px: int, device: torch.device) -> Tensor:
    """The first ``count`` frames of a packed file as (count, 3, px, px) uint8, channels last.

    Raises:
        InputError: the file is no packed frames, has another size, or holds too few of them.
    """
    frames = read_packed(path)
    if frames.shape[1] != input_px:
        raise InputError(
            f"{path}: holds {frames.dtype} {frames.shape}, expected uint8 (N, {input_px}, "
            f"{input_px}, 3) for this network.input_px; pack the frames again"
        )
    if len(frames) < count:
        raise InputError(f"{path}: holds {len(frames)} frames, but {count} are labelled")
    return torch.from_numpy(np.array(frames[:count])).to(device).permute(0, 3, 1, 2)


def read_labelled_frames(
    frames: Path, labels: Path, input_px: int, device: torch.device
) -> LabelledFrames:
    """Every labelled frame with its pose; ``frames`` may hold more, for larger sets.

    Raises:
        InputError: one of the files cannot be used, or there are no labels.
    """
    table = read_pose_table(labels)
    if len(table) == 0:
        raise InputError(f"{labels}: has no rows; nothing to learn from")
    images = read_images(frames, len(table), input_px, device)
    position_m, quat_wxyz = _poses(table, device)
    return LabelledFrames(images, position_m, quat_wxyz)


def image_statistics(images: Tensor) -> ImageStatistics:
    """Statistics over all pixels of images (N, 3, H, W) uint8."""
    total = torch.zeros(3, dtype=torch.float64, device=images.device)
    squares = torch.zeros_like(total)
    for chunk in torch.split(images, CHUNK):
        values = chunk.float()
        total += values.sum((0, 2, 3))
        squares += values.square_().sum((0, 2, 3))
    n_values = images[:, 0].numel()
    mean = total / n_values
    # An image of one colour has no deviation; half a grey level keeps the division harmless.
    deviation = (squares / n_values - mean**2).clamp_min(0.25).sqrt()
    shape = (1, 3, 1, 1)
    return ImageStatistics(mean.float().view(shape), deviation.float().view(shape))


def _poses(table: PoseTable, device: torch.device) -> tuple[Tensor, Tensor]:
    position_m = torch.as_tensor(table.position_m, dtype=torch.float32, device=device)
    quat_wxyz = torch.as_tensor(table.quat_wxyz, dtype=torch.float32, device=device)
    return position_m, quat_wxyz
