"""What rendering was measured to cost and to be worth: the lines of ``render_speed.csv``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from synfeal.frames import COUNT, NUMBER, TEXT, frame_of, write_frame


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


KINDS = {"str": TEXT, "int": COUNT, "float": NUMBER}
SCHEMA = {name: KINDS[str(kind)] for name, kind in Measured.__annotations__.items()}


def write_speed(path: Path, lines: Iterable[Measured]) -> None:
    """Write one line per camera and variant; the times differ between runs."""
    write_frame(path, frame_of(map(asdict, lines), SCHEMA), float_format=None)
