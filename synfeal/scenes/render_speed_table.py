"""What rendering was measured to cost and to be worth: the lines of ``render_speed.csv``."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from synfeal.errors import InputError
from synfeal.files import atomic_path


@dataclass(frozen=True)
class Measured:
    """One way to draw the frames of one camera.

    Attributes:
        backend: what draws.
        width, height: of the image, pixels.
        supersampling: samples per pixel along each axis.
        texture_scale: side of the textures over that of the scene's own.
        faces: triangles.
        ms_per_frame: time of a colour image, milliseconds.
        mean_abs_error: mean difference from 64 samples per pixel, in levels of 0 to 255.
        psnr_db: peak signal-to-noise ratio against the same.
        depth_error_mm: median difference of depth from the full mesh's at the same pixel centres,
            where both hit something.
        depth_off_share: share of those pixels where it is more than 10 mm.
        chosen: 1 for what the profile renders with, else 0.
    """

    backend: str
    width: int
    height: int
    supersampling: int
    texture_scale: float
    faces: int
    ms_per_frame: float
    mean_abs_error: float
    psnr_db: float
    depth_error_mm: float
    depth_off_share: float
    chosen: int


COLUMNS = [field.name for field in fields(Measured)]
LINE = TypeAdapter(Measured)


def write_speed(path: Path, lines: Iterable[Measured]) -> None:
    """Write one line per camera and variant; the times differ between runs."""
    with (
        atomic_path(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(map(asdict, lines))


def read_speed(path: Path) -> list[Measured]:
    """Read what :func:`write_speed` wrote.

    Raises:
        InputError: the file is missing, has other columns, or holds what is not a measurement.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            if reader.fieldnames != COLUMNS:
                raise InputError(f"{path}: columns must be {','.join(COLUMNS)}; measure again")
            return [LINE.validate_python(row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error, ValidationError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: cannot be read as speeds of rendering ({reason})") from None
