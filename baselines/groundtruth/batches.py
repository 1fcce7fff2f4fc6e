"""Cutting a split into the batches of section 4.1."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Batch:
    """A run of consecutive frames that is estimated on its own."""

    index: int  # position of the batch in its split
    start: int  # first frame, which is also the last frame of the batch before
    stop: int  # one past the last frame

    def __len__(self) -> int:
        return self.stop - self.start


def batches_of(n_frames: int, batch_frames: int) -> list[Batch]:
    """Batches of a split: batch b holds frames b*B to (b+1)*B, both included, cut at the end.

    Every batch adds at most ``batch_frames`` frames to the one it shares with the batch before, and
    every batch has at least two frames. A split of one frame has no batch: its pose is the anchor.

    Raises:
        ValueError: ``n_frames`` or ``batch_frames`` is below 1.
    """
    if n_frames < 1 or batch_frames < 1:
        raise ValueError(
            f"need at least one frame and batch_frames >= 1: {n_frames}, {batch_frames}"
        )
    last = n_frames - 1
    starts = range(0, last, batch_frames)
    return [
        Batch(index, start, min(start + batch_frames, last) + 1)
        for index, start in enumerate(starts)
    ]
