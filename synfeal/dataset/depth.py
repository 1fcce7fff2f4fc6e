"""Depth images: 16-bit grey PNG, the one reader of them.

A pixel holds a whole number of units, millimetres unless said otherwise, along the optical axis
(along the ray of fisheyes and panoramas). Ours hold 65535 where nothing is; sensors and other
programs write 0. Both are no measurement, whoever wrote the file.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import read_image
from synfeal.errors import InputError

INVALID_MM = 65535
MILLIMETRES = 1000.0  # units per metre

Depth = NDArray[np.float32]
DepthUnits = NDArray[np.uint16]


def read_depth_m(
    path: FrameFile,
    *,
    units_per_m: float = MILLIMETRES,
    nothing: float = np.inf,
    size: tuple[int, int] | None = None,
    remedy: str = "",
) -> Depth:
    """Read a depth image in metres.

    Args:
        path: 16-bit grey image, on its own or inside an archive.
        units_per_m: Units that a metre is stored as.
        nothing: Value of pixels without a measurement.
        size: Width and height that it must have, pixels.
        remedy: Advice at the end of messages.

    Returns:
        Depth (H, W), ``nothing`` where 0 or 65535 is stored.

    Raises:
        InputError: See :func:`read_depth_units`.
    """
    units = read_depth_units(path, size=size, remedy=remedy)
    depth_m = units.astype(np.float32) / np.float32(units_per_m)
    return np.where(is_measured(units), depth_m, np.float32(nothing))


def read_depth_units(
    path: FrameFile, *, size: tuple[int, int] | None = None, remedy: str = ""
) -> DepthUnits:
    """Read a depth image (H, W) as stored.

    Args:
        path: 16-bit grey image, on its own or inside an archive.
        size: Width and height that it must have, pixels.
        remedy: Advice at the end of messages.

    Raises:
        InputError: It is missing, damaged, of another size, or no 16-bit grey image.
    """
    image = read_image(path, size=size, remedy=remedy)
    stored = np.asarray(image)
    if not image.mode.startswith("I") or stored.min() < 0 or stored.max() > INVALID_MM:
        raise InputError(
            f"{path}: must be a 16-bit grey image of depth, not of mode {image.mode}{remedy}"
        )
    return stored.astype(np.uint16, copy=False)


def is_measured(units: DepthUnits) -> NDArray[np.bool_]:
    """Tell which pixels (H, W) of a stored depth image are a measurement."""
    return (units > 0) & (units < INVALID_MM)


def share_beyond_storage(depth_m: Depth) -> float:
    """Return the share of pixels that show a surface too far away for its depth to be stored."""
    depth_mm = np.round(np.asarray(depth_m, np.float64) * MILLIMETRES)
    return float(np.mean(np.isfinite(depth_mm) & (depth_mm >= INVALID_MM)))


def depth_mm_of(depth_m: Depth) -> DepthUnits:
    """Convert depth (H, W) in metres to millimetres; 65535 beyond 65.534 m and for nothing hit."""
    depth_mm = np.round(np.asarray(depth_m, np.float64) * MILLIMETRES)
    return np.minimum(depth_mm, INVALID_MM).astype(np.uint16)
