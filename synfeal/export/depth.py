"""Depth images in other units, with 0 where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from synfeal.dataset.archive import FrameFile
from synfeal.dataset.sevenscenes import INVALID_MM
from synfeal.validation.images import read_depth_mm


def rewrite_depth(source: FrameFile, target: Path, units_per_m: int) -> float:
    """Write a depth image anew; returns the share of known depths that are too large for it.

    Args:
        source: 16-bit PNG in millimetres, 0 or 65535 where there is no depth.
        target: 16-bit PNG to write, 0 where there is no depth or it is beyond 65535 units.
        units_per_m: units of ``target`` in a metre.

    Raises:
        InputError: ``source`` cannot be read.
    """
    depth_mm = read_depth_mm(source)
    known = (depth_mm > 0) & (depth_mm < INVALID_MM)
    units = np.round(depth_mm.astype(np.float64) * (units_per_m / 1000.0))
    fits = known & (units <= 65535)
    target.parent.mkdir(parents=True, exist_ok=True)
    image = Image.fromarray(np.where(fits, units, 0).astype(np.uint16))
    image.save(target, compress_level=1)  # others take several times as long
    n_known = int(np.count_nonzero(known))
    return 1.0 - int(np.count_nonzero(fits)) / max(n_known, 1)
