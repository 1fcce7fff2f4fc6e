"""Previews of data sets: films of their paths, side by side, and contact sheets."""

from __future__ import annotations

import importlib.util
import math
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from PIL import Image, ImageDraw

from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import read_image
from synfeal.dataset.layer_pictures import PICTURES
from synfeal.dataset.sequence_listing import SequenceListing
from synfeal.dataset.sevenscenes import Split
from synfeal.dataset.split_frames import read_split_frames
from synfeal.errors import Argument, InputError
from synfeal.records.files import atomic_path, lies_in, refuse_unwritable

TILE_WIDTH_PX, TITLE_PX = 320, 16


def write_preview(
    datasets: Sequence[Path],
    out: Path,
    n_frames: int,
    fps: float,
    split: Split = "train",
    show: Sequence[str] = ("color",),
) -> int:
    """Write a GIF or MP4 of the first frames of data sets, side by side under their names.

    Args:
        datasets: Data sets.
        out: File to write; its ending decides the format.
        n_frames: Frames to show, at most.
        fps: Frames a second.
        split: Which frames.
        show: Layers to show of each data set, keys of :data:`PICTURES`.

    Returns:
        Number of frames shown.

    Raises:
        InputError: a data set has no such frames, a number is out of its bounds, or there is no
            encoder.
    """
    if n_frames < 1:
        raise InputError(Argument("frames"), f"must be at least 1, found {n_frames}")
    if not 0.01 <= fps <= 50:
        raise InputError(
            Argument("fps"), f"must be 0.01 to 50, which a GIF can show, found {fps:g}"
        )
    write = WRITERS.get(out.suffix.lower())
    if write is None:
        raise InputError(
            Argument("out"), f"{out}: a preview is a GIF or MP4", "end its name in .gif or .mp4"
        )
    if out.exists():
        raise InputError(out, "exists", "delete it or choose another file with `out`")
    found = [read_split_frames(dataset, split) for dataset in datasets]
    for frames in found:
        _refuse_among_frames(out, frames.sequences)
    refuse_unwritable(out)
    if write is _write_mp4:
        encoder()  # missing, it is to be missed before any image is read
    columns = []
    for dataset, frames in zip(datasets, found, strict=True):
        for name in show:
            layer = PICTURES[name]
            if name != "color" and not any(s.numbers[layer.kind] for s in frames.sequences):
                raise InputError(
                    Argument("show"),
                    f"{dataset} has no {name}",
                    f"collect it with {layer.collected_with}, or leave it out",
                )
            title = dataset.resolve().name + (f" {name}" if len(show) > 1 else "")
            columns.append(Column(title, frames.files(layer.kind)[:n_frames], layer.picture))
    pictures = list(_rows(columns))
    if not pictures:
        raise InputError(datasets[0], f"has no {split} frames", "choose the other `split`")
    with atomic_path(out) as temporary:
        write(pictures, fps, temporary)
    return len(pictures)


def _refuse_among_frames(out: Path, sequences: Iterable[SequenceListing]) -> None:
    """Refuse a place where the picture could be taken for one of a frame."""
    for sequence in sequences:
        if lies_in(out, sequence.path):
            raise InputError(
                Argument("out"),
                f"{out} lies among the frames of {sequence.path}",
                "choose a place beside them",
            )


def encoder() -> str:
    """Find the program that encodes films: the system's, or that of the wheel ``imageio-ffmpeg``.

    It is run as a program of its own, so its licence (GPL, for x264) does not reach this one.

    Raises:
        InputError: Neither is there.
    """
    found = shutil.which("ffmpeg")
    if found is None and importlib.util.find_spec("imageio_ffmpeg") is not None:
        from imageio_ffmpeg import get_ffmpeg_exe

        with suppress(RuntimeError):  # a wheel without the program
            found = get_ffmpeg_exe()
    if found is None:
        raise InputError(
            Argument("out"),
            "MP4 needs ffmpeg, which is not there",
            "apt-get install ffmpeg or pip install 'synfeal[video]', or end the name in .gif",
        )
    return str(found)


def _write_gif(pictures: Sequence[Image.Image], fps: float, out: Path) -> None:
    """Write a GIF of 256 colours per picture; dithering would flicker and hide the noise shown."""
    plain = [p.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE) for p in pictures]
    plain[0].save(out, "GIF", save_all=True, append_images=plain[1:], duration=1e3 / fps, loop=0)


def _write_mp4(pictures: Sequence[Image.Image], fps: float, out: Path) -> None:
    """Write H.264 in the one pixel format that all browsers play, which needs even sides."""
    width, height = pictures[0].size
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}"]
    even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]
    coded = ["-c:v", "libx264", "-crf", "18", "-movflags", "+faststart", *BIT_EXACT]
    command = [encoder(), "-v", "error", "-y", *raw, "-i", "-", *even, *coded, str(out)]
    frames = b"".join(picture.tobytes() for picture in pictures)
    done = subprocess.run(command, input=frames, capture_output=True, check=False)
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines() or ["it said nothing"]
        raise InputError(
            Argument("out"), f"ffmpeg cannot write H.264 ({said[-1][:200]})", "use .gif"
        )


BIT_EXACT = ("-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact")  # no versions in it
WRITERS = {".gif": _write_gif, ".mp4": _write_mp4}


class Column(NamedTuple):
    """Pictures shown in one place, moment after moment."""

    name: str
    files: Sequence[FrameFile]
    picture: Callable[[FrameFile], Image.Image]


def _rows(columns: Sequence[Column]) -> Iterator[Image.Image]:
    """Yield the frames of all data sets side by side, until the shortest ends."""
    names = [column.name for column in columns]
    for moment in zip(*(column.files for column in columns), strict=False):
        pictures = (column.picture(file) for column, file in zip(columns, moment, strict=True))
        tiles = [_tile(picture, TILE_WIDTH_PX) for picture in pictures]
        height = max(tile.height for tile in tiles)
        row = Image.new("RGB", (TILE_WIDTH_PX * len(tiles), height + TITLE_PX))
        for index, (tile, name) in enumerate(zip(tiles, names, strict=True)):
            row.paste(tile, (index * TILE_WIDTH_PX, TITLE_PX))
            ImageDraw.Draw(row).text((index * TILE_WIDTH_PX + 4, 2), name, "white")
        yield row


def _tile(frame: Image.Image, width: int) -> Image.Image:
    height = max(1, round(frame.height * width / frame.width))
    return frame.resize((width, height), Image.Resampling.LANCZOS)


SHEET_FRAMES, SHEET_COLUMNS, SHEET_TILE_PX = 24, 6, 240


def write_contact_sheet(frames: Sequence[FrameFile], out: Path) -> None:
    """Write a grid of at most 24 frames, evenly spaced over ``frames`` (at least one)."""
    count = min(SHEET_FRAMES, len(frames))
    chosen = [frames[index * len(frames) // count] for index in range(count)]
    tiles = [_tile(read_image(path), SHEET_TILE_PX) for path in chosen]
    width, height = tiles[0].size
    columns = min(SHEET_COLUMNS, count)
    sheet = Image.new("RGB", (columns * width, math.ceil(count / columns) * height))
    for index, tile in enumerate(tiles):
        sheet.paste(tile, (index % columns * width, index // columns * height))
    with atomic_path(out) as temporary:
        sheet.save(temporary)
