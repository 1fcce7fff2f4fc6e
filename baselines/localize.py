"""A trained localizer on a person's own pictures: which files they are, and poses out."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from PIL import Image, ImageOps
from torch import Tensor

from baselines.training.checkpoint import ModelDescription, TrainedLocalizer, read_checkpoint
from baselines.training.device import open_device
from baselines.training.predict import BATCH, predict, predict_ms
from synfeal.dataset.packed import View, fit_frame
from synfeal.dataset.pose_table import COLUMNS
from synfeal.dataset.render_sequence import Progress
from synfeal.errors import InputError, why
from synfeal.files import writing_to
from synfeal.frames import write_frame

Array = NDArray[np.float64]

log = logging.getLogger(__name__)

HEADER = ("image", *COLUMNS[2:])


class Localized(NamedTuple):
    """What became of some pictures."""

    description: ModelDescription  # of the localizer
    device: str  # where it ran, ``cpu`` or ``cuda``
    n_images: int  # pictures
    n_failed: int  # those whose pose is not finite
    read_ms: float  # median time to read and shrink a picture
    network_ms: float  # median time of the network on one picture alone
    images_per_s: float  # pictures per second in batches, reading included


def localize(
    model: Path, named: Sequence[Path], out: Path, device: Literal["auto", "cpu", "cuda"]
) -> Localized:
    """Write the pose of each picture as CSV (columns of ``HEADER``), in the order named.

    Poses are ``world_from_cam`` in the world of the training labels. A pose that is not finite is
    written as ``nan``. A directory stands for its pictures; ``out`` appears when all are done.

    Raises:
        InputError: the model or a picture cannot be used, or ``out`` cannot be written.
    """
    trained = read_checkpoint(model, open_device(device))
    pictures = find_pictures(named)
    _check_out(out, [model, *pictures])
    network_ms = predict_ms(trained, _batch(trained, pictures[:1], []))
    read_s: list[float] = []
    began = time.perf_counter()
    position_m, quat_wxyz = _predict_all(trained, pictures, read_s)
    seconds = time.perf_counter() - began
    _write(out, pictures, np.concatenate([position_m, quat_wxyz], axis=1))
    good = np.isfinite(position_m).all(axis=1) & np.isfinite(quat_wxyz).all(axis=1)
    return Localized(
        description=trained.description,
        device=trained.device.type,
        n_images=len(pictures),
        n_failed=int((~good).sum()),
        read_ms=1000 * median(read_s),
        network_ms=network_ms,
        images_per_s=len(pictures) / seconds,
    )


def _predict_all(
    trained: TrainedLocalizer, pictures: Sequence[Path], read_s: list[float]
) -> tuple[Array, Array]:
    """Positions (N, 3) and quaternions (N, 4), in batches as a test set is predicted in."""
    poses = []
    with Progress(len(pictures), "localize") as progress:
        for start in range(0, len(pictures), BATCH):
            began = time.perf_counter()
            batch = pictures[start : start + BATCH]
            poses.append(predict(trained, _batch(trained, batch, read_s)))
            progress.update(len(batch))
            if len(pictures) > BATCH:
                name = f"picture {start + len(batch)} of {len(pictures)}"
                progress.part_done(name, len(batch), time.perf_counter() - began)
    position_m, quat_wxyz = zip(*poses, strict=True)
    return np.concatenate(position_m), np.concatenate(quat_wxyz)


def _batch(trained: TrainedLocalizer, pictures: Sequence[Path], read_s: list[float]) -> Tensor:
    """Pictures as (B, 3, px, px) uint8, channels last; notes how long each took to read."""
    network = trained.description.network
    px = network.input_px
    frames = np.empty((len(pictures), px, px, 3), np.uint8)
    for frame, path in zip(frames, pictures, strict=True):
        began = time.perf_counter()
        frame[:] = read_picture(path, px, network.view)
        read_s.append(time.perf_counter() - began)
    return torch.from_numpy(frames).to(trained.device).permute(0, 3, 1, 2)


def _check_out(out: Path, inputs: Sequence[Path]) -> None:
    if out.is_dir():
        raise InputError(f"{out}: is a directory; name a file with --out")
    if out.exists() and any(path.exists() and out.samefile(path) for path in inputs):
        raise InputError(f"{out}: is one of the inputs; choose another file with --out")
    if os.path.lexists(out) and not _holds_poses(out):
        raise InputError(f"{out}: exists and holds no poses; choose another file with --out")


def _holds_poses(out: Path) -> bool:
    """Whether an earlier command wrote it."""
    try:
        with out.open("rb") as file:
            return file.readline(200).strip() == ",".join(HEADER).encode()
    except OSError:
        return False


def _write(out: Path, pictures: Sequence[Path], poses: Array) -> None:
    """Numbers with enough digits to read back the same values; names as the bytes they are."""
    frame = pd.DataFrame(poses, columns=list(HEADER[1:]))
    frame.insert(0, HEADER[0], pd.Series([str(path) for path in pictures], dtype=object))
    with writing_to(out, lambda: "choose another file with --out"):
        write_frame(out, frame, float_format=None, na_rep="nan")


SUFFIXES = (".png", ".jpg", ".jpeg")
# Modes of eight bits or fewer per channel; what else there is has no scale that is known.
MODES = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "CMYK", "YCbCr")
# A longer picture has no square with as much to see as a training frame has.
MAX_ASPECT = 20


def find_pictures(named: Iterable[Path]) -> list[Path]:
    """The files named, and in place of a directory the pictures in it, sorted by name.

    Of a 7-Scenes sequence these are the colour images: ``*.depth.png`` is left out.

    Raises:
        InputError: something named is not there, or a directory holds no picture.
    """
    found: list[Path] = []
    for path in named:
        if not (path.is_dir() or path.is_file()):
            raise InputError(f"{path}: there is no such picture or directory")
        found += _in(path) if path.is_dir() else [path]
    return found


def read_picture(path: Path, input_px: int, view: View = "square") -> NDArray[np.uint8]:
    """Pixels (input_px, input_px, 3), made by the function that packs training frames.

    A picture is first turned upright by its EXIF orientation; rendered frames have none, so the
    packer does not look. Grey, palette and CMYK become RGB; an alpha channel is left out.

    Raises:
        InputError: the file is damaged, or is no picture of eight bits per channel.
    """
    try:
        with Image.open(path, formats=("PNG", "JPEG")) as image:
            if image.mode not in MODES:
                problem = f"holds pixels of mode {image.mode}, such as depth, not 8-bit colours"
            elif max(image.size) > MAX_ASPECT * min(image.size):
                size = f"{image.width} x {image.height}"
                problem = f"is {size} pixels, too long for a square to be cut out"
            else:
                upright = ImageOps.exif_transpose(image)
                if "transparency" in upright.info:  # a palette's: Pillow knows this way only
                    upright = upright.convert("RGBA")
                return fit_frame(upright.convert("RGB"), input_px, view)
    except Exception as error:  # a damaged file is refused in every way there is
        problem = f"cannot be read as a PNG or JPEG picture ({why(error)})"
    raise InputError(f"{path}: {problem}; leave it out or repair it")


def _in(directory: Path) -> list[Path]:
    try:
        files = sorted(path for path in directory.iterdir() if path.is_file())
    except OSError as error:
        raise InputError(f"{directory}: cannot be listed ({error.strerror})") from None
    if any(directory.glob("seq-[0-9]*")):
        raise InputError(f"{directory}: is a data set; name its sequences, {directory}/seq-01")
    found = [path for path in files if _is_picture(path.name.lower())]
    if not found:
        raise InputError(f"{directory}: holds no {', '.join(SUFFIXES)}; name another directory")
    return found


def _is_picture(name: str) -> bool:
    hidden_or_depth = name.startswith(".") or name.endswith(".depth.png")
    return name.endswith(SUFFIXES) and not hidden_or_depth
