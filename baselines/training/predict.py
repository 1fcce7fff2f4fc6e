"""Predictions of a trained localizer."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from baselines.localizers.memory import memory_errors
from baselines.training.checkpoint import TrainedLocalizer, read_checkpoint
from baselines.training.data import read_images
from baselines.training.device import open_device
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table

# Of a prediction, metres and quaternions: float32 holds hardly more, and files stay small.
DECIMALS = 6
# Images per step; float32 sums may come out differently in the last digits at another number.
BATCH = 100
TIMED_CALLS = 10


class Predictions(NamedTuple):
    """Predicted poses of frames, and the poses of the same frames in the table that named them."""

    predicted: PoseTable
    given: PoseTable


@memory_errors()
def predict_poses(
    model: Path,
    frames: Path,
    labels_like: Path,
    out: Path,
    device: Literal["auto", "cpu", "cuda"] = "auto",
    every: int = 1,
) -> None:
    """Write predictions as a pose table with unit quaternions, w >= 0.

    Args:
        model: Checkpoint.
        frames: Packed frames of the split.
        labels_like: A pose table that says which frames there are; its poses are not used.
        out: Pose table to write; a value the network gives no finite number for is ``nan``.
        device: Device to predict on.
        every: Predict the first of each so many frames.

    Raises:
        InputError: one of the files cannot be used.
        MemoryError: there is too little memory.
    """
    write_predictions(read_checkpoint(model, open_device(device)), frames, labels_like, out, every)


@memory_errors()
def write_predictions(
    trained: TrainedLocalizer, frames: Path, labels_like: Path, out: Path, every: int = 1
) -> Predictions:
    """Do what :func:`predict_poses` does with a localizer in memory.

    Args:
        trained: The localizer, on the device to predict on.
        frames: Packed frames of the split.
        labels_like: A pose table that says which frames there are; its poses are not used.
        out: Pose table to write; a value the network gives no finite number for is ``nan``.
        every: Predict the first of each so many frames.

    Raises:
        InputError: one of the files cannot be used.
        MemoryError: there is too little memory.
    """
    table = read_pose_table(labels_like)
    given = table.at(np.arange(0, len(table), every))
    input_px = trained.description.network.input_px
    images = read_images(frames, len(given), input_px, trained.device, every)
    predicted = PoseTable(given.frame, given.path, *predict(trained, images))
    write_pose_table(out, predicted)
    return Predictions(predicted, given)


@torch.inference_mode()
def predict(
    trained: TrainedLocalizer, images: Tensor
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Predict positions (N, 3) and unit quaternions (N, 4), w >= 0, for images (N, 3, H, W) uint8.

    Both have :data:`DECIMALS` decimals.

    A quaternion of zeros, or with a value that is not finite, stands for no rotation: it is
    returned as four times ``nan``.
    """
    normalise = trained.statistics.normalise
    main = [trained.network(normalise(batch))[0] for batch in torch.split(images, BATCH)]
    position_m = torch.cat([p.position_m for p in main]).double().cpu()
    quat_wxyz = normalised_quat_wxyz(torch.cat([p.quat_wxyz for p in main]))
    quat_wxyz = torch.where(quat_wxyz[:, :1] < 0, -quat_wxyz, quat_wxyz)
    return position_m.numpy().round(DECIMALS), quat_wxyz.numpy().round(DECIMALS)


def normalised_quat_wxyz(quat_wxyz: Tensor) -> Tensor:
    """Scale quaternions (N, 4) of any length to 1, in double precision on the processor.

    One of zeros, or with a value that is not finite, is no rotation and becomes ``nan``.
    """
    # In double precision the length of no float32 quaternion but 0 is 0; 0 / 0 and inf / inf: nan.
    unit = quat_wxyz.double().cpu()
    unit = unit / torch.linalg.vector_norm(unit, dim=1, keepdim=True)
    return torch.where(unit.isfinite().all(dim=1, keepdim=True), unit, torch.nan)


def predict_ms(trained: TrainedLocalizer, images: Tensor) -> float:
    """Measure the median milliseconds of predicting images (N, 3, H, W) at once."""
    return median_ms(lambda: predict(trained, images))


def median_ms(act: Callable[[], object]) -> float:
    """Time an action that ends on the processor, ms: the median of a few after a warm-up."""
    act()
    times_s = []
    for _ in range(TIMED_CALLS):
        begin = time.perf_counter()
        act()
        times_s.append(time.perf_counter() - begin)
    return 1000 * float(np.median(times_s))
