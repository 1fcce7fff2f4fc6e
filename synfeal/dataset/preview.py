"""The paths of data sets as a moving picture, side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path

from PIL import Image, ImageDraw

from synfeal.dataset.archive import FrameFile
from synfeal.dataset.png import IMAGE_DAMAGE
from synfeal.dataset.sequences import Split
from synfeal.dataset.sevenscenes import frame_paths, read_split
from synfeal.errors import InputError, why
from synfeal.files import atomic_path

TILE_WIDTH_PX = 320
TITLE_PX = 16


def write_preview(
    datasets: Sequence[Path], out: Path, n_frames: int, fps: float, split: Split = "train"
) -> int:
    """Write a GIF of the first frames of data sets, each under its name; how many it shows.

    Raises:
        InputError: a data set has no such frames, or a number is out of its bounds.
    """
    if n_frames < 1:
        raise InputError(f"--frames: {n_frames} frames are no picture; at least 1 is needed")
    if not 0 < fps <= 50:
        raise InputError(f"--fps: must be above 0 and at most 50, which a GIF can show, not {fps}")
    if out.suffix.lower() != ".gif":
        raise InputError(f"--out: {out}: a preview is a GIF; end its name in .gif")
    columns = [frame_paths(read_split(dataset, split), "color.png") for dataset in datasets]
    names = [dataset.resolve().name for dataset in datasets]
    pictures = list(_rows([frames[:n_frames] for frames in columns], names))
    if not pictures:
        raise InputError(f"{datasets[0]}: has no {split} frames; choose the other --split")
    with atomic_path(out) as temporary:
        pictures[0].save(
            temporary, "GIF", save_all=True, append_images=pictures[1:], duration=1e3 / fps, loop=0
        )
    return len(pictures)


def _rows(columns: Sequence[Sequence[FrameFile]], names: Sequence[str]) -> Iterator[Image.Image]:
    """The frames of all data sets at one moment, until the shortest ends; 256 colours of its own.

    Dithering would flicker, and hide the noise that is to be seen.
    """
    for moment in zip(*columns, strict=False):
        tiles = [_tile(file) for file in moment]
        height = max(tile.height for tile in tiles)
        row = Image.new("RGB", (TILE_WIDTH_PX * len(tiles), height + TITLE_PX))
        for index, (tile, name) in enumerate(zip(tiles, names, strict=True)):
            row.paste(tile, (index * TILE_WIDTH_PX, TITLE_PX))
            ImageDraw.Draw(row).text((index * TILE_WIDTH_PX + 4, 2), name, "white")
        yield row.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def _tile(file: FrameFile) -> Image.Image:
    try:
        with Image.open(BytesIO(file.read_bytes())) as frame:
            height = max(1, round(frame.height * TILE_WIDTH_PX / frame.width))
            return frame.convert("RGB").resize((TILE_WIDTH_PX, height), Image.Resampling.LANCZOS)
    except IMAGE_DAMAGE as error:
        raise InputError(f"{file}: cannot be read as an image ({why(error)})") from None
