"""One picture of many frames: the first thing to look at after a collection."""

from __future__ import annotations

import math
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from PIL import Image

from synfeal.dataset.archive import FrameFile
from synfeal.files import atomic_path

MAX_FRAMES = 24
COLUMNS = 6
TILE_WIDTH_PX = 240


def write_contact_sheet(frames: Sequence[FrameFile], out: Path) -> None:
    """A grid of at most 24 frames, evenly spaced over ``frames`` (at least one)."""
    count = min(MAX_FRAMES, len(frames))
    chosen = [frames[index * len(frames) // count] for index in range(count)]
    with Image.open(BytesIO(chosen[0].read_bytes())) as first:
        tile = (TILE_WIDTH_PX, max(1, round(first.height * TILE_WIDTH_PX / first.width)))
    columns = min(COLUMNS, count)
    sheet = Image.new("RGB", (columns * tile[0], math.ceil(count / columns) * tile[1]))
    for index, path in enumerate(chosen):
        with Image.open(BytesIO(path.read_bytes())) as frame:
            small = frame.resize(tile, Image.Resampling.LANCZOS)
        sheet.paste(small, (index % columns * tile[0], index // columns * tile[1]))
    with atomic_path(out) as temporary:
        sheet.save(temporary)
