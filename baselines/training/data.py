"""Load frames and poses; batch order; held-out paths."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from synfeal.dataset.packed import read_packed
from synfeal.dataset.pose_table import read_pose_table
from synfeal.errors import InputError
from synfeal.records.provenance import generator_of

# A larger set is not read on a processor: it stays on the disk, mapped into memory.
MOST_READ_BYTES = 2**31
# Frames per step when a whole set is read, or its statistics are computed.
CHUNK = 500


@dataclass(frozen=True)
class ImageStatistics:
    """Mean and standard deviation (1, 3, 1, 1) of a training set's channels, in grey levels."""

    mean: Tensor
    deviation: Tensor

    def normalise(self, images: Tensor) -> Tensor:
        """Return float images (B, 3, H, W) of uint8 ones; the memory layout is kept."""
        return images.to(torch.float32, copy=True).sub_(self.mean).div_(self.deviation)


class Batch(NamedTuple):
    """Images (B, 3, H, W) uint8, positions (B, 3) in metres and unit quaternions (B, 4)."""

    images: Tensor
    position_m: Tensor
    quat_wxyz: Tensor


@dataclass(frozen=True)
class LabelledFrames:
    """A split on the device, or a part of one: parts share the images.

    Attributes:
        images: (N, 3, H, W) uint8 of the split, channels last in memory.
        position_m: (M, 3) float32, of the part.
        quat_wxyz: (M, 4) float32, of the part, unit length.
        path: (M,) index of the straight path each frame of the part belongs to.
        rows: (M,) int64: which of the images belong to the part.
    """

    images: Tensor
    position_m: Tensor
    quat_wxyz: Tensor
    path: NDArray[np.int64]
    rows: Tensor

    def __len__(self) -> int:
        return len(self.rows)

    def batch(self, chosen: Tensor) -> Batch:
        """Return the frames of the part with these indices (B,)."""
        rows = self.rows[chosen]
        return Batch(self.images[rows], self.position_m[chosen], self.quat_wxyz[chosen])

    def part(self, mask: NDArray[np.bool_]) -> LabelledFrames:
        """Select the frames of the part where ``mask`` (M,) is true; no image is copied."""
        kept = torch.from_numpy(np.flatnonzero(mask)).to(self.rows.device)
        return LabelledFrames(
            self.images,
            self.position_m[kept],
            self.quat_wxyz[kept],
            self.path[mask],
            self.rows[kept],
        )


def read_images(
    path: Path, count: int, input_px: int, device: torch.device, every: int = 1
) -> Tensor:
    """Read frames of a packed file.

    Beside the result no more than ``CHUNK`` frames are in memory, on whatever device it is. On a
    processor a result of over 2 GiB is a map of the file, which must not be changed meanwhile.

    Args:
        path: Packed frames, uint8 (N, px, px, 3).
        count: Number of frames to read.
        input_px: Side they must have, pixels.
        device: Device of the result.
        every: Read the first of each so many frames.

    Returns:
        Images (count, 3, px, px), uint8, channels last.

    Raises:
        InputError: the file is no packed frames, has another size, or holds too few of them.
    """
    frames = read_packed(path)
    if frames.shape[1] != input_px:
        raise InputError(
            path,
            f"holds {frames.dtype} {frames.shape}, expected uint8 (N, {input_px}, {input_px}, 3)"
            " for this network.input_px",
            "pack the frames again",
        )
    thinned = frames[::every]
    if len(thinned) < count:
        raise InputError(path, f"holds {len(thinned)} frames, but {count} are labelled")
    n_bytes = count * input_px**2 * 3
    if device.type == "cpu" and n_bytes > MOST_READ_BYTES and every == 1:
        content = torch.from_file(str(path), size=frames.offset + n_bytes, dtype=torch.uint8)
        return content[frames.offset :].view(count, input_px, input_px, 3).permute(0, 3, 1, 2)
    images = torch.empty((count, *frames.shape[1:]), dtype=torch.uint8, device=device)
    for start in range(0, count, CHUNK):
        chunk = images[start : start + CHUNK]
        chunk.copy_(torch.from_numpy(np.array(thinned[start : start + len(chunk)])))
    return images.permute(0, 3, 1, 2)


def read_labelled_frames(
    frames: Path, labels: Path, input_px: int, device: torch.device
) -> LabelledFrames:
    """Read every labelled frame with its pose.

    Frames whose labels were filled in, because no method registered them, are left out.

    Args:
        frames: Packed frames; there may be more of them than labels, for larger sets.
        labels: Pose table of the first frames.
        input_px: Side the frames must have, pixels.
        device: Device of the result.

    Raises:
        InputError: one of the files cannot be used, or there are no labels.
    """
    table = read_pose_table(labels)
    if len(table) == 0:
        raise InputError(labels, "has no rows; nothing to learn from")
    usable = table.usable_rows
    if len(usable) == 0:
        raise InputError(labels, "no frame is registered; nothing to learn from")
    images = read_images(frames, len(table), input_px, device)
    rows = torch.as_tensor(usable, device=device)
    known = table.at(usable)
    position_m = torch.as_tensor(known.position_m, dtype=torch.float32, device=device)
    quat_wxyz = torch.as_tensor(known.quat_wxyz, dtype=torch.float32, device=device)
    return LabelledFrames(images, position_m, quat_wxyz, known.path, rows)


def image_statistics(images: Tensor) -> ImageStatistics:
    """Compute the statistics over all pixels of images (N, 3, H, W) uint8."""
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


class BatchOrder:
    """Batches of frame indices: one epoch after another, cut without regard to epochs.

    Every batch is full, also when the set is smaller than a batch, so batch statistics stay stable.
    Epochs are drawn on the processor, in one order for every device, and copied to it whole: a GPU
    is not waited for at every step.

    Args:
        n_frames: Frames of an epoch.
        batch_size: Frames of a batch.
        seed: Seed of the order.
        shuffled: Draw a new order for every epoch.
        device: Device of the batches.
    """

    def __init__(
        self,
        n_frames: int,
        batch_size: int,
        seed: int,
        shuffled: bool = True,
        device: torch.device | str = "cpu",
    ) -> None:
        self._n_frames, self._batch_size, self._shuffled = n_frames, batch_size, shuffled
        self._generator = torch.Generator().manual_seed(seed)
        self._pending = torch.empty(0, dtype=torch.long, device=device)

    def next_batch(self) -> Tensor:
        """Return the indices (batch_size,) of the next batch."""
        while len(self._pending) < self._batch_size:
            epoch = torch.arange(self._n_frames)
            if self._shuffled:
                epoch = torch.randperm(self._n_frames, generator=self._generator)
            self._pending = torch.cat([self._pending, epoch.to(self._pending.device)])
        batch = self._pending[: self._batch_size]
        self._pending = self._pending[self._batch_size :]
        return batch

    def state_dict(self) -> dict[str, Any]:
        """Return the state of the order."""
        pending = self._pending.cpu().clone()
        return {"generator": self._generator.get_state(), "pending": pending}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another order stood."""
        self._generator.set_state(state["generator"])
        self._pending = state["pending"].to(self._pending.device)


def held_out_paths(path: NDArray[np.int64], share: float, seed: int) -> NDArray[np.bool_]:
    """Mark the frames of some paths, drawn at random, to hold out of training.

    Whole paths, because neighbouring frames of a path are nearly the same image.

    Args:
        path: Path (N,) of each frame.
        share: Share of the paths to hold out, 0 to 1. Unless it is 0, at least one of two or more
            paths is held out, and never all.
        seed: Seed of the draw.

    Returns:
        Whether each frame (N,) is held out.
    """
    paths = np.unique(path)
    drawn = generator_of("held-out paths", seed).permutation(paths)[: _n_held_out(paths, share)]
    return np.isin(path, drawn)


def held_out_stretch(path: NDArray[np.int64], share: float, seed: int) -> NDArray[np.bool_]:
    """Mark the frames of paths that follow each other, to hold out of training.

    A planned path begins where the one before it ended, and photographs are taken in order: a path
    drawn alone lies between two that are learned. The frames of a stretch are about as far from all
    others as those of an independent test split are.

    Args:
        path: Path (N,) of each frame, numbered in the order of the way.
        share: Share of the paths to hold out; see :func:`held_out_paths`.
        seed: Seed of the draw.

    Returns:
        Whether each frame (N,) is held out.
    """
    paths = np.unique(path)
    count = _n_held_out(paths, share)
    first = generator_of("held-out stretch", seed).integers(len(paths) - count + 1)
    return np.isin(path, paths[first : first + count])


def _n_held_out(paths: NDArray[np.int64], share: float) -> int:
    return min(max(round(share * len(paths)), 1), len(paths) - 1) if share > 0 else 0
