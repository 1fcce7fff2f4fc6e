"""Files of frames, in a directory or an archive, and a fast PNG codec.

``seq-01.zip``, unpacked where it lies, is the directory ``seq-01``. The authors of 7-Scenes ship
theirs so; a large data set then takes one file for each sequence instead of three for each frame.
Nothing is compressed again, for images are already. Archives that others packed are read too,
compressed or not. Where functions take a sequence they take either form: ``seq-01`` or
``seq-01.zip``.

PNG files are encoded several times as fast as libraries do it, at the same size: Pillow tries every
filter on every row and compresses with zlib. In such frames one fixed filter does as well, and
libdeflate is the faster compressor. ISA-L takes half the time of libdeflate, but now and then, once
in tens of thousands of frames, gave other bytes for the same pixels.
"""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path, PurePath

import deflate
import numpy as np
from numpy.typing import NDArray

from synfeal.errors import why
from synfeal.records.files import atomic_path

SUFFIX = ".zip"
MOST_OPEN = 16  # archives; each holds a file descriptor
MOST_BYTES = 2**28  # no member is that large, but a damaged archive may say so
MOST_PIXELS = 8192**2  # in a frame, as in a camera
# The earliest time the format knows: archives of the same frames are the same bytes.
EPOCH = (1980, 1, 1, 0, 0, 0)
UNIX, PLAIN_FILE = 3, 0o100644
# What zipfile raises on damaged or encrypted archives.
ARCHIVE_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    ValueError,
    NotImplementedError,
    RuntimeError,
    OverflowError,
)


@dataclass(frozen=True)
class ArchivedFile:
    """A file of an archived sequence, read like the path it has when it is unpacked."""

    archive: Path  # ``<data set>/seq-01.zip``
    name: str  # ``frame-000000.color.png``

    def __str__(self) -> str:
        return str(self.archive / self.name)

    @property
    def parent(self) -> Path:
        """The directory it lies in when it is unpacked."""
        return self.archive.with_suffix("")

    @property
    def suffix(self) -> str:
        """As a path has it: ``.png``."""
        return PurePath(self.name).suffix

    def read_bytes(self, most_bytes: int = MOST_BYTES) -> bytes:
        """Read the member and verify its checksum.

        Args:
            most_bytes: Members that unpack to more are not read.

        Raises:
            OSError: it is missing (``FileNotFoundError``), or the archive is damaged.
        """
        member = f"{self.archive.stem}/{self.name}"
        with reading(self.archive) as opened:
            try:
                info = opened.getinfo(member)
            except KeyError as error:
                raise FileNotFoundError(f"{self}: missing") from error
            if info.file_size > most_bytes:
                raise OSError(f"{info.file_size} bytes are too many for such a file")
            return opened.read(info)

    def read_text(self, encoding: str = "utf-8") -> str:
        """Read the file as text."""
        return self.read_bytes().decode(encoding)

    def is_file(self) -> bool:
        """Tell whether the archive holds the member."""
        return self.archive.is_file() and self.name in sequence_names(self.archive)


# A file of a sequence, wherever it lies.
FrameFile = Path | ArchivedFile


def is_archive(sequence: Path) -> bool:
    """Tell whether a sequence is named as an archive; a directory has no suffix."""
    return sequence.suffix == SUFFIX


def sequence_at(directory: Path) -> Path:
    """Return the form in which a sequence is stored: ``seq-01``, or else ``seq-01.zip``."""
    archive = directory.with_name(directory.name + SUFFIX)
    return archive if archive.is_file() and not directory.is_dir() else directory


def frame_file(sequence: Path, name: str) -> FrameFile:
    """Return a file of a sequence, which need not exist."""
    return ArchivedFile(sequence, name) if is_archive(sequence) else sequence / name


def sequence_names(sequence: Path) -> list[str]:
    """List the names of the files of a sequence, in order."""
    if not is_archive(sequence):
        return sorted(path.name for path in sequence.iterdir() if path.is_file())
    prefix = f"{sequence.stem}/"
    with reading(sequence) as opened:
        return sorted(
            name.removeprefix(prefix)
            for name in opened.namelist()
            if _is_plain(name, prefix) and name != prefix
        )


def foreign_members(archive: Path) -> list[str]:
    """List members that would not unpack to one file each in the directory of the sequence."""
    prefix = f"{archive.stem}/"
    with reading(archive) as opened:
        counts = Counter(opened.namelist())
    return [name for name, count in counts.items() if count > 1 or not _is_plain(name, prefix)]


def _is_plain(name: str, prefix: str) -> bool:
    """Tell whether a member is ``seq-01/`` or a file directly in it."""
    rest = name.removeprefix(prefix)
    return name.startswith(prefix) and rest not in (".", "..") and not set(rest) & set("/\\")


def write_archive(directory: Path, archive: Path) -> None:
    """Pack ``frame-*`` of a directory; the archive appears, safe on the disk, when it is complete.

    The same frames always give the same bytes.
    """
    with atomic_path(archive) as temporary:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as packed:
            for path in sorted(directory.glob("frame-*")):
                info = zipfile.ZipInfo(f"{archive.stem}/{path.name}", EPOCH)
                info.create_system, info.external_attr = UNIX, PLAIN_FILE << 16
                packed.writestr(info, path.read_bytes())
        with temporary.open("rb") as file:  # the frames may be deleted as soon as it is there
            os.fsync(file.fileno())


def link_or_unpack(source: FrameFile, target: Path) -> None:
    """Put a file at ``target`` for programs that read paths: a link, or what an archive holds."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(source, ArchivedFile):
        target.write_bytes(source.read_bytes())
    else:
        target.symlink_to(source.resolve())


@contextmanager
def reading(archive: Path) -> Iterator[zipfile.ZipFile]:
    """Open an archive; raise what is wrong with it as an ``OSError`` that names it."""
    try:
        status = archive.stat()
        yield _opened(archive, status.st_ino, status.st_size, status.st_mtime_ns)
    except ARCHIVE_DAMAGE as error:
        raise OSError(f"{archive}: is damaged ({why(error)})") from error


@lru_cache(MOST_OPEN)
def _opened(archive: Path, *_: int) -> zipfile.ZipFile:
    """Open an archive once; one that is written anew under the same name has another status."""
    return zipfile.ZipFile(archive)


SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREY, RGB = 0, 2  # colour types of the format
FILTER_UP = 2  # each byte is stored as its difference from the byte above
LEVEL = 1

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


def encode_png(pixels: Pixels, text: Mapping[str, str] | None = None) -> bytes:
    """Encode an image as PNG.

    Args:
        pixels: Colours (H, W, 3) uint8 or grey values (H, W) uint16.
        text: Texts by keyword, both of Latin-1; :func:`decode_png` leaves such files to Pillow.

    Raises:
        ValueError: The pixels are neither.
    """
    is_rgb = pixels.ndim == 3 and pixels.shape[2] == 3 and pixels.dtype == np.uint8
    if not is_rgb and not (pixels.ndim == 2 and pixels.dtype == np.uint16):
        raise ValueError(f"cannot encode pixels {pixels.shape} {pixels.dtype} as PNG")
    height, width = pixels.shape[:2]
    colors = RGB if is_rgb else GREY
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.itemsize, colors, 0, 0, 0)
    data = deflate.zlib_compress(_filtered(pixels), LEVEL)
    texts = [f"{key}\0{value}".encode("latin-1") for key, value in (text or {}).items()]
    chunks = [_chunk(b"IHDR", header), *(_chunk(b"tEXt", content) for content in texts)]
    chunks += [_chunk(b"IDAT", data), _chunk(b"IEND", b"")]
    return SIGNATURE + b"".join(chunks)


def _filtered(pixels: Pixels) -> NDArray[np.uint8]:
    """Filter rows of bytes, most significant first, each preceded by its filter."""
    big_endian = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(">"))
    rows = big_endian.view(np.uint8).reshape(len(pixels), -1)
    filtered = np.empty((rows.shape[0], rows.shape[1] + 1), np.uint8)
    filtered[:, 0] = FILTER_UP
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])  # modulo 256, as the format asks
    return filtered


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


_HEADER = struct.Struct(">IIBBBBB")  # of IHDR
_START = len(SIGNATURE) + 8 + _HEADER.size + 4  # where what follows IHDR begins


def decode_png(content: bytes) -> Pixels | None:
    """Decode a file that :func:`encode_png` wrote, verifying every checksum.

    In half the time that Pillow takes. None for damaged files and for those of other programs,
    which Pillow reads or says what is wrong with them.
    """
    if len(content) < _START + 8 or not content.startswith(SIGNATURE):
        return None
    width, height, bits, colors, *others = _HEADER.unpack_from(content, len(SIGNATURE) + 8)
    kind = {(8, RGB): (3, np.uint8), (16, GREY): (1, np.uint16)}.get((bits, colors))
    if kind is None or any(others) or width * height > MOST_PIXELS:
        return None
    header = content[len(SIGNATURE) + 8 : _START - 4]
    (length,) = struct.unpack_from(">I", content, _START)
    data = content[_START + 8 : _START + 8 + length]
    chunks = _chunk(b"IHDR", header), _chunk(b"IDAT", data), _chunk(b"IEND", b"")
    if content != SIGNATURE + b"".join(chunks):
        return None
    channels, dtype = kind
    row = 1 + width * channels * np.dtype(dtype).itemsize
    try:
        rows = np.frombuffer(deflate.zlib_decompress(data, height * row), np.uint8)
    except deflate.DeflateError:
        return None
    if rows.size != height * row or (rows[::row] != FILTER_UP).any():
        return None
    plain = rows.reshape(height, row)[:, 1:].copy()
    for above, line in pairwise(plain):  # ten times as fast as accumulate
        np.add(above, line, out=line)
    if channels == 3:
        return plain.reshape(height, width, 3)
    return plain.view(">u2").astype(np.uint16)
