"""The image files that a reference method may read of a split."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from synfeal.dataset.archive import FrameFile
from synfeal.dataset.sevenscenes import frame_paths


def files_of_split(
    sequences: Sequence[Path], split: str, n_frames: int
) -> tuple[list[FrameFile], list[FrameFile] | None]:
    """Colour and depth images of the first frames; of a test set no depth: none may be used.

    Raises:
        InputError: a sequence cannot be read or has no such file.
    """
    color = frame_paths(sequences, "color.png")[:n_frames]
    depth = frame_paths(sequences, "depth.png")[:n_frames] if split == "train" else None
    return color, depth
