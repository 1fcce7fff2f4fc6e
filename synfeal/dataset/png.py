"""Images of frames: read, and as PNG files encoded several times as fast as libraries do it.

At the same size: Pillow tries every filter on every row and compresses with zlib. In such frames
one fixed filter does as well, and libdeflate is the faster compressor. ISA-L takes half the time of
libdeflate, but now and then, once in tens of thousands of frames, gave other bytes for the same
pixels.
"""

from __future__ import annotations

import io
import struct
import zlib

import deflate
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.archive import FrameFile
from synfeal.errors import read_as

SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREY, RGB = 0, 2  # colour types of the format
FILTER_UP = 2  # each byte is stored as its difference from the byte above
LEVEL = 1

# What Pillow raises on damaged files, decompression bombs included.
IMAGE_DAMAGE = (
    *(OSError, SyntaxError, ValueError, EOFError, struct.error, MemoryError),
    Image.DecompressionBombError,
)

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


def encode_png(pixels: Pixels) -> bytes:
    """A PNG file of colours (H, W, 3) uint8 or of grey values (H, W) uint16."""
    is_rgb = pixels.ndim == 3 and pixels.shape[2] == 3 and pixels.dtype == np.uint8
    if not is_rgb and not (pixels.ndim == 2 and pixels.dtype == np.uint16):
        raise ValueError(f"cannot encode pixels {pixels.shape} {pixels.dtype} as PNG")
    height, width = pixels.shape[:2]
    header = struct.pack(
        ">IIBBBBB", width, height, 8 * pixels.itemsize, RGB if is_rgb else GREY, 0, 0, 0
    )
    data = deflate.zlib_compress(_filtered(pixels), LEVEL)
    chunks = _chunk(b"IHDR", header), _chunk(b"IDAT", data), _chunk(b"IEND", b"")
    return SIGNATURE + b"".join(chunks)


def _filtered(pixels: Pixels) -> NDArray[np.uint8]:
    """Rows of bytes, most significant first, each after its filter and as differences."""
    big_endian = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(">"))
    rows = big_endian.view(np.uint8).reshape(len(pixels), -1)
    filtered = np.empty((rows.shape[0], rows.shape[1] + 1), np.uint8)
    filtered[:, 0] = FILTER_UP
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])  # modulo 256, as the format asks
    return filtered


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def read_image(path: FrameFile, mode: str | None = None) -> Image.Image:
    """A decoded image, converted to ``mode`` if one is given."""
    with (
        read_as(path, "an image", *IMAGE_DAMAGE),
        Image.open(io.BytesIO(path.read_bytes())) as image,
    ):
        image.load()
        return image.convert(mode) if mode else image.copy()
