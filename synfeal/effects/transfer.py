"""Between what files hold and light: the sRGB transfer function (IEC 61966-2-1), by tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Light = NDArray[np.float32]
Rgb = NDArray[np.uint8]
STEPS = 2**15 - 1  # of light: less than a tenth of a level of the file even where it is darkest


def _linear(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _encoded(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


_LIGHT: Light = _linear(np.arange(256) / 255).astype(np.float32)
_LEVEL: Rgb = np.round(255 * _encoded(np.arange(STEPS + 1) / STEPS)).astype(np.uint8)


def light_of(rgb: Rgb) -> Light:
    """Light (...), white is 1, of what files hold (...)."""
    return np.asarray(np.take(_LIGHT, rgb))


def rgb_of(light: Light) -> Rgb:
    """What files hold (...) of light (...); what is beyond white is white."""
    step = np.clip(light * np.float32(STEPS) + np.float32(0.5), 0, STEPS).astype(np.uint16)
    return np.asarray(np.take(_LEVEL, step))
