"""Depth images: 16-bit grey PNG, the one reader of them.

A pixel holds a whole number of units, millimetres unless said otherwise, along the optical axis
(along the ray of fisheyes and panoramas). Ours hold 65535 where nothing is; sensors and other
programs write 0. Both are no measurement, whoever wrote the file.

Other programs also write 32-bit floating-point numbers (TIFF), which are metres; what is not
positive or not finite is no measurement.

Millimetres of 16 bits end at 65.5 m. Where a data set is stored in coarser units, each of its files
says so in a text of PNG (chunk ``tEXt``, keyword ``depth_units_per_m``), which goes before
everything else that is said of the units.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.frame_files import FrameFile, encode_png
from synfeal.dataset.images import read_image
from synfeal.errors import InputError, read_as

INVALID = 65535
MILLIMETRES = 1000.0  # units per metre
MOST_METRES = 200.0  # median of a depth image; numbers above are of a smaller unit

UNITS_KEY = "depth_units_per_m"

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
        path: 16-bit or floating-point grey image, on its own or inside an archive.
        units_per_m: Units that a metre is stored as, where whole numbers are stored and the file
            does not say it.
        nothing: Value of pixels without a measurement.
        size: Width and height that it must have, pixels.
        remedy: Advice at the end of messages.

    Returns:
        Depth (H, W), ``nothing`` where nothing was measured.

    Raises:
        InputError: It is missing, damaged, of another size, or no grey image of 16 bits or floats.
    """
    image = read_image(path, size=size, remedy=remedy)
    if image.mode == "F":
        return _of_floats(np.asarray(image, dtype=np.float32), path, nothing)
    units, own_units_per_m = _stored(image, path, remedy)
    depth_m = units.astype(np.float32) / np.float32(own_units_per_m or units_per_m)
    return np.where(is_measured(units), depth_m, np.float32(nothing))


def _of_floats(stored: Depth, path: FrameFile, nothing: float) -> Depth:
    """Take floating-point numbers (H, W) for metres, unless most are too many for that."""
    is_depth = np.isfinite(stored) & (stored > 0)
    median = float(np.median(stored[is_depth])) if is_depth.any() else 0.0
    if median > MOST_METRES:
        raise InputError(
            path,
            f"its floating-point numbers count as metres, and half of them are above {median:.4g}",
            "divide them by the units of a metre (1000 for millimetres), or store whole numbers of"
            " 16 bits",
        )
    return np.where(is_depth, stored, np.float32(nothing))


def _stored(image: Image.Image, path: FrameFile, remedy: str) -> tuple[DepthUnits, float | None]:
    """Return a depth image (H, W) as stored, and its units a metre where it says so itself."""
    stored = np.asarray(image)
    if not image.mode.startswith("I") or stored.min() < 0 or stored.max() > INVALID:
        raise InputError(
            path,
            f"must be a 16-bit grey image of depth, not of mode {image.mode}{remedy}",
        )
    return stored.astype(np.uint16, copy=False), _units_in(image, path)


def own_units_per_m(path: FrameFile) -> float | None:
    """Read the units of a metre that a depth image says; None where it says nothing.

    Raises:
        InputError: It is missing or damaged.
    """
    return _units_in(read_image(path), path)


def _units_in(image: Image.Image, path: FrameFile) -> float | None:
    """Return the units of a metre that a file says; None where it says nothing.

    Raises:
        InputError: What it says is no positive number.
    """
    said = image.info.get(UNITS_KEY)
    if said is None:
        return None
    with read_as(path, "a depth image", TypeError, ValueError):
        units_per_m = float(said)
    if not 0 < units_per_m < np.inf:
        raise InputError(path, f"{UNITS_KEY}: must be above 0, found {said[:40]!r}")
    return units_per_m


def is_measured(units: DepthUnits) -> NDArray[np.bool_]:
    """Tell which pixels (H, W) of a stored depth image are a measurement."""
    return (units > 0) & (units < INVALID)


def share_beyond_storage(depth_m: Depth, units_per_m: float = MILLIMETRES) -> float:
    """Return the share of pixels that show a surface too far away for its depth to be stored."""
    units = np.round(np.asarray(depth_m, np.float64) * units_per_m)
    return float(np.mean(np.isfinite(units) & (units >= INVALID)))


def depth_units_of(depth_m: Depth, units_per_m: float = MILLIMETRES) -> DepthUnits:
    """Convert depth (H, W) in metres to units; 65535 for nothing hit and what is too far away."""
    units = np.round(np.asarray(depth_m, np.float64) * units_per_m)
    return np.minimum(units, INVALID).astype(np.uint16)


def farthest_m(units_per_m: float = MILLIMETRES) -> float:
    """Return the largest depth that can be stored, metres."""
    return (INVALID - 1) / units_per_m


def encode_depth(depth_m: Depth, units_per_m: float = MILLIMETRES) -> bytes:
    """Encode depth (H, W) in metres as PNG, which says its units if they are not millimetres."""
    text = {} if units_per_m == MILLIMETRES else {UNITS_KEY: f"{units_per_m:.17g}"}
    return encode_png(depth_units_of(depth_m, units_per_m), text)
