"""Predictions of a trained localizer for a test set."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from baselines.localizers.base import Localizer
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import load_checkpoint
from baselines.training.data import ImageStatistics, read_images
from baselines.training.device import open_device
from synfeal.config.models import LocalizerConfig, NetworkConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table

BATCH = 100


def predict_poses(
    name: str,
    model: Path,
    frames: Path,
    labels_like: Path,
    network: NetworkConfig,
    hyper: LocalizerConfig,
    out: Path,
) -> None:
    """Write predictions as a pose table with unit quaternions, w >= 0.

    Args:
        name: a key of ``LOCALIZERS``.
        model: checkpoint of it.
        frames: packed frames of the split.
        labels_like: a pose table that says which frames there are; its poses are not used.
        network: input side and width the model was trained with.
        hyper: of this localizer.
        out: pose table to write; poses of a diverged network are ``nan``.

    Raises:
        InputError: one of the files cannot be used.
    """
    device = open_device("auto")
    table = read_pose_table(labels_like)
    images = read_images(frames, len(table), network.input_px, device)
    localizer = build_localizer(name, network, hyper)
    localizer.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
    statistics = load_checkpoint(model, localizer, device)
    position_m, quat_wxyz = predict(localizer, images, statistics)
    write_pose_table(out, PoseTable(table.frame, table.path, position_m, quat_wxyz))


@torch.inference_mode()
def predict(
    localizer: Localizer, images: Tensor, statistics: ImageStatistics
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (N, 3) and unit quaternions (N, 4), w >= 0, for images (N, 3, H, W) uint8."""
    localizer.eval()
    main = [localizer(statistics.normalise(batch))[0] for batch in torch.split(images, BATCH)]
    position_m = torch.cat([p.position_m for p in main]).double().cpu()
    quat_wxyz = nn.functional.normalize(
        torch.cat([p.quat_wxyz for p in main]).double().cpu(), dim=1
    )
    quat_wxyz = torch.where(quat_wxyz[:, :1] < 0, -quat_wxyz, quat_wxyz)
    return position_m.numpy(), quat_wxyz.numpy()
