"""Pictures of pages, each with a digest of the numbers that it shows in its metadata.

Drawn on another machine a picture has other bytes, so that a check of pages compares digests.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure
from PIL import Image

from reproduction.figures.style import RC
from synfeal.records.files import atomic_path

DPI = 150
SOURCE = "Source"  # key of the digest in the metadata


def digest(lines: Sequence[str]) -> str:
    """Hash what is drawn, given as text, numbers to six digits."""
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def stamped_png(draw: Callable[[], Figure], source: str) -> bytes:
    """Draw a figure in the house's style as PNG.

    Args:
        draw: Makes the figure; called with the style set.
        source: Digest of what it shows.
    """
    buffer = io.BytesIO()
    with matplotlib.rc_context(rc=RC):
        draw().savefig(
            buffer,
            format="png",
            dpi=DPI,
            metadata={"Software": None, SOURCE: source},
            bbox_inches="tight",
            pad_inches=0.1,
        )
    return buffer.getvalue()


def write_stamped(content: bytes, out_png: Path) -> None:
    """Write a picture whole or not at all."""
    with atomic_path(out_png) as temporary:
        temporary.write_bytes(content)


def shows(png: Path, source: str) -> bool:
    """Tell whether an existing picture has this digest."""
    if not png.is_file():
        return False
    with Image.open(png) as image:
        return image.info.get(SOURCE) == source
