"""Figures inside the page: vector graphics as they are, pictures made small enough."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from pathlib import Path

from PIL import Image

LARGEST_SVG = 1_000_000  # bytes; clouds of points are smaller as a picture
LARGEST_PNG = 250_000
LARGEST_SIDE_PX = 1800


def figure_files(folder: Path, captions: Mapping[str, str]) -> dict[str, Path]:
    """One file per figure of a folder, those with captions first and in their order."""
    found: dict[str, Path] = {}
    for path in sorted(folder.glob("*.png")) + sorted(folder.glob("*.svg")):
        is_large = path.suffix == ".svg" and path.stat().st_size > LARGEST_SVG
        if not (is_large and path.stem in found):
            found[path.stem] = path
    order = [*(name for name in captions if name in found), *sorted(found)]
    return {name: found[name] for name in dict.fromkeys(order)}


def data_address(path: Path) -> str:
    """A picture as a ``data:`` address; large PNG files become WebP."""
    content, kind = path.read_bytes(), "svg+xml" if path.suffix == ".svg" else "png"
    if kind == "png" and len(content) > LARGEST_PNG:
        content, kind = _smaller(content), "webp"
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _smaller(png: bytes) -> bytes:
    with Image.open(io.BytesIO(png)) as image:
        picture = image.convert("RGB")
    picture.thumbnail((LARGEST_SIDE_PX, LARGEST_SIDE_PX))
    buffer = io.BytesIO()
    picture.save(buffer, "WEBP", quality=85, method=4)
    return buffer.getvalue()
