"""Frames at network resolution in one array: read by memory map, decoded once for all trainings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.sevenscenes import frame_paths
from synfeal.errors import InputError
from synfeal.files import atomic_path


def pack_frames(sequence_dirs: list[Path], input_px: int, out: Path) -> None:
    """Write the colour frames of the sequences, in order, as one ``.npy``.

    uint8 (N, input_px, input_px, 3). As in the published code the short side is resized to
    ``input_px + 1`` and the centre is cut out; the resize averages (no aliasing).

    Raises:
        InputError: a sequence has no frames, or a frame cannot be read.
    """
    paths = frame_paths(sequence_dirs, "color.png")
    shape = (len(paths), input_px, input_px, 3)
    with atomic_path(out) as temporary:
        frames = np.lib.format.open_memmap(temporary, mode="w+", dtype=np.uint8, shape=shape)
        for index, path in enumerate(paths):
            frames[index] = fit_frame(_open(path), input_px)
        frames.flush()


def fit_frame(image: Image.Image, input_px: int) -> NDArray[np.uint8]:
    """Pixels (input_px, input_px, 3): short side resized to ``input_px + 1``, then centre crop."""
    scale = (input_px + 1) / min(image.size)
    width, height = (max(input_px + 1, round(side * scale)) for side in image.size)
    small = image.resize((width, height), Image.Resampling.BILINEAR)
    left, top = (width - input_px) // 2, (height - input_px) // 2
    return np.asarray(small.crop((left, top, left + input_px, top + input_px)))


def _open(path: Path) -> Image.Image:
    try:
        return Image.open(path).convert("RGB")
    except (OSError, SyntaxError) as error:  # Pillow raises both on damaged files
        raise InputError(f"{path}: cannot be read as an image ({error})") from None
