"""Frames at network resolution in one array, decoded once and memory-mapped by all runs.

A file beside it says what they are: enough to know them apart and to check a copy.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.images import read_image
from synfeal.dataset.sevenscenes import frames_between
from synfeal.errors import InputError, read_as
from synfeal.records.files import atomic_path, file_sha256, read_json, write_json
from synfeal.records.provenance import frame_versions

COPIED_BYTES = 2**24  # at a time


@contextmanager
def new_packed(out: Path, n_frames: int, input_px: int) -> Iterator[NDArray[np.uint8]]:
    """Yield an array (n_frames, input_px, input_px, 3) to fill; its file appears at the end."""
    shape = (n_frames, input_px, input_px, 3)
    with atomic_path(out) as temporary:
        frames = np.lib.format.open_memmap(temporary, mode="w+", dtype=np.uint8, shape=shape)
        if hasattr(os, "posix_fallocate"):  # else a full disk kills the process that fills a page
            with temporary.open("r+b") as file:
                os.posix_fallocate(file.fileno(), 0, temporary.stat().st_size)
        yield frames
        frames.flush()


def pack_frames(
    sequences: list[Path], input_px: int, out: Path, view: NetworkView = "square"
) -> None:
    """Write the colour frames of sequences, in order, as one ``.npy``.

    Args:
        sequences: Directories or archives of frames.
        input_px: Side of the packed frames, pixels.
        out: File to write: uint8 (N, input_px, input_px, 3).
        view: Whether all of a frame or its central square is packed, see :func:`fit_frame`.
    """
    paths = frames_between(sequences, "color.png")
    with new_packed(out, len(paths), input_px) as packed:
        for index, path in enumerate(paths):
            packed[index] = fit_frame(read_image(path, "RGB"), input_px, view)


def join_packed(parts: list[Path], out: Path) -> None:
    """Write packed frames of one size one after the other into one file; a few are in memory.

    Raises:
        InputError: A file is no packed frames, or of another size than the first.
    """
    arrays = [read_packed(path) for path in parts]
    input_px = arrays[0].shape[1]
    for path, array in zip(parts, arrays, strict=True):
        if array.shape[1] != input_px:
            raise InputError(path, f"holds frames of {array.shape[1]} px, others {input_px} px")
    header = np.lib.format.header_data_from_array_1_0(arrays[0])
    header["shape"] = (sum(map(len, arrays)), *arrays[0].shape[1:])
    with atomic_path(out) as temporary, temporary.open("wb") as joined:
        np.lib.format.write_array_header_1_0(joined, header)
        for path, array in zip(parts, arrays, strict=True):
            with path.open("rb") as part:
                part.seek(array.offset)
                shutil.copyfileobj(part, joined, COPIED_BYTES)


def read_packed(path: Path) -> np.memmap[Any, np.dtype[np.uint8]]:
    """Open packed frames (N, S, S, 3) as a memory map.

    Raises:
        InputError: The file is missing or damaged, or holds something else.
    """
    # A damaged header is refused in every way there is.
    with read_as(path, "packed frames", Exception, remedy="; render it again"):
        frames: np.memmap[Any, np.dtype[np.uint8]] = np.lib.format.open_memmap(path, mode="r")
    side = frames.shape[1] if frames.ndim == 4 else 0
    if frames.dtype != np.uint8 or frames.shape[1:] != (side, side, 3) or np.isfortran(frames):
        raise InputError(path, f"holds {frames.dtype} {frames.shape}, not packed frames")
    return frames


NetworkView = Literal["square", "whole"]


class Crop(NamedTuple):
    """A frame made smaller, and where in it the square lies that localizers see; pixels."""

    width: int
    height: int
    left: int
    top: int


def crop_of(size: tuple[int, int], input_px: int, view: NetworkView = "square") -> Crop:
    """Return what localizers see of a frame.

    Args:
        size: Width and height of the frame, pixels.
        input_px: Side of the square that localizers see, pixels.
        view: ``square``: as in the published code, the short side becomes ``input_px + 1`` and the
            centre is cut out. ``whole``: all of it, squeezed into the square; nothing the camera
            saw is lost.
    """
    if view == "whole":
        return Crop(input_px, input_px, 0, 0)
    scale = (input_px + 1) / min(size)
    width, height = (max(input_px + 1, round(side * scale)) for side in size)
    return Crop(width, height, (width - input_px) // 2, (height - input_px) // 2)


def fit_frame(image: Image.Image, input_px: int, view: NetworkView = "square") -> NDArray[np.uint8]:
    """Crop and resize an image to (input_px, input_px, 3) by :func:`crop_of`, averaging pixels."""
    width, height, left, top = crop_of(image.size, input_px, view)
    small = image.resize((width, height), Image.Resampling.BILINEAR)
    return np.asarray(small.crop((left, top, left + input_px, top + input_px)))


def _read_shard(path: Path) -> dict[str, Any]:
    """Read which frames a shard holds, and what drew them."""
    damage = (OSError, ValueError, TypeError, LookupError)
    with read_as(path, "the record of a shard", *damage, remedy="; render it again"):
        record = read_json(path)
        frames, backend = record["frames"], record["backend"]
        if type(frames) is not int or type(backend) is not str:
            raise ValueError("frames must be a whole number, backend a name")
    return {"name": path.stem, **record}


def write_packed(
    plan: Path,
    shards: list[Path],
    records: list[Path],
    camera: CameraConfig,
    render: RenderConfig,
    view: NetworkView,
    out_frames: Path,
    detail: Path | None = None,
) -> None:
    """Join parts of packed frames, and describe them in a ``.json`` file beside the ``.npy``.

    Args:
        plan: Pose table of the frames.
        shards: Parts of packed frames, in order.
        records: Records of the parts, in the same order.
        camera: Camera that rendered them, before they were made smaller.
        render: Backend and effects they were rendered with.
        view: Whether all of a frame or its central square was packed.
        out_frames: File ``.npy`` to write.
        detail: Record of the level of detail, if it was chosen.
    """
    join_packed(shards, out_frames)
    square = "short side resized to S + 1 px, then centre crop"
    seen = square if view == "square" else "the whole frame resized to S x S px"
    packed = read_packed(out_frames)
    parts = [_read_shard(path) for path in records]
    backends = ", ".join(sorted({part["backend"] for part in parts}))  # never ``auto``
    record = {
        "format": f"uint8 (N, S, S, 3); {seen}",
        "frames": len(packed),
        "input_px": packed.shape[1],
        "camera": camera.record,
        "render": render.model_dump(mode="json") | {"backend": backends},
        "plan_sha256": file_sha256(plan),
        "sha256": file_sha256(out_frames),
        "shards": parts,
        "versions": frame_versions(),
    }
    if detail is not None:
        record["detail"] = read_json(detail)
    write_json(out_frames.with_suffix(".json"), record)
