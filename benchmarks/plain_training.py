"""What one would write without this project: a data set of image files and a loop over a loader."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from scipy.spatial.transform import Rotation
from torch import Tensor
from torch.optim.lr_scheduler import StepLR
from torch.utils.data import DataLoader, Dataset, Sampler

from baselines.localizers.base import Localizer
from baselines.training.data import ImageStatistics
from baselines.training.optimizer import Schedule
from baselines.training.order import BatchOrder

Item = tuple[Tensor, Tensor]


class ImageFiles(Dataset[Item]):
    """Frames of a directory in the layout of 7-Scenes: every item is read, decoded and resized."""

    def __init__(self, directory: Path, input_px: int, statistics: ImageStatistics) -> None:
        self._images = sorted(directory.glob("frame-*.color.png"))
        self._input_px = input_px
        self._mean, self._deviation = (
            value.view(3, 1, 1) / 255 for value in (statistics.mean, statistics.deviation)
        )

    def __len__(self) -> int:
        return len(self._images)

    def __getitem__(self, index: int) -> Item:
        """Image (3, px, px), normalised, and pose (7,): position in metres, quaternion wxyz."""
        path = self._images[index]
        with Image.open(path) as image:
            pixels = np.array(centre_square(image.convert("RGB"), self._input_px))
        levels = torch.from_numpy(pixels).permute(2, 0, 1).contiguous().float().div(255)
        pose = read_pose(path.with_name(path.name.replace("color.png", "pose.txt")))
        return levels.sub(self._mean).div(self._deviation), pose


def centre_square(image: Image.Image, input_px: int) -> Image.Image:
    """Short side resized to ``input_px + 1``, then the centre."""
    scale = (input_px + 1) / min(image.size)
    width, height = (round(side * scale) for side in image.size)
    left, top = (width - input_px) // 2, (height - input_px) // 2
    small = image.resize((width, height), Image.Resampling.BILINEAR)
    return small.crop((left, top, left + input_px, top + input_px))


def read_pose(path: Path) -> Tensor:
    """Position and quaternion wxyz (7,), w >= 0, of a file with a 4 x 4 matrix."""
    world_from_cam = np.loadtxt(path)
    x, y, z, w = Rotation.from_matrix(world_from_cam[:3, :3]).as_quat(canonical=True)
    return torch.tensor([*world_from_cam[:3, 3], w, x, y, z], dtype=torch.float32)


class Batches(Sampler[list[int]]):
    """The batches that our training shows, in its order."""

    def __init__(self, n_frames: int, batch_size: int, steps: int, seed: int) -> None:
        self._order = BatchOrder(n_frames, batch_size, seed, shuffled=False)
        self._steps = steps

    def __len__(self) -> int:
        return self._steps

    def __iter__(self) -> Iterator[list[int]]:
        for _ in range(self._steps):
            yield self._order.next_batch().tolist()


def train_plainly(
    localizer: Localizer,
    images: ImageFiles,
    schedule: Schedule,
    seed: int,
    workers: int,
) -> list[float]:
    """Train with Adam, halving the rate at intervals: the losses of all steps."""
    optimizer = torch.optim.Adam(
        localizer.parameters(), lr=schedule.learning_rate, weight_decay=schedule.weight_decay
    )
    halve_after = max(1, round(schedule.halve_every * schedule.steps))
    scheduler = StepLR(optimizer, halve_after, gamma=0.5)
    batches = Batches(len(images), schedule.batch_size, schedule.steps, seed)
    losses = []
    localizer.train()
    for levels, pose in DataLoader(images, batch_sampler=batches, num_workers=workers):
        loss = localizer.loss(localizer(levels), pose[:, :3], pose[:, 3:])
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        scheduler.step()
        losses.append(loss.item())
    return losses
