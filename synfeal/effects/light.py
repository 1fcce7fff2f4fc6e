"""Light of a path, and the camera's response to it, in linear light.

The transfer function of the files is that of IEC 61966-2-1, by tables.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual.color import linear_to_srgb, srgb_to_linear

from synfeal.config.effects import ExposureConfig, LightConfig, NoiseConfig
from synfeal.effects.files import LIGHT_GROUPS

Light = NDArray[np.float32]
Rgb = NDArray[np.uint8]
STEPS = 2**15 - 1  # levels of light: finer than a tenth of a level of the file, even in the dark

_LIGHT: Light = srgb_to_linear(np.arange(256) / 255).astype(np.float32)
_LEVEL: Rgb = np.round(255 * linear_to_srgb(np.arange(STEPS + 1) / STEPS)).astype(np.uint8)

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # weights of linear sRGB
DAYLIGHT_K = 6500.0
_RGB_FROM_XYZ = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)
DARKEST = 1e-4  # mean light that auto-exposure takes black frames for

WAVES = 6
# Weights of `LIGHT_GROUPS`; `lamps` and `daylight` add up to the scene's own light.
STATES: dict[str, tuple[float, float, float]] = {
    "all": (1.0, 1.0, 1.0),
    "lamps": (0.5, 1.0, 0.0),
    "daylight": (0.5, 0.0, 1.0),
    "dusk": (0.25, 1.0, 0.15),
    "night": (0.05, 0.1, 0.0),
}


def light_of(rgb: Rgb) -> Light:
    """Convert sRGB bytes (...) to linear light (...), white at 1."""
    return np.asarray(np.take(_LIGHT, rgb))


def rgb_of(light: Light) -> Rgb:
    """Encode light (...) as files hold it; everything beyond white is white."""
    step = np.clip(light * np.float32(STEPS) + np.float32(0.5), 0, STEPS).astype(np.uint16)
    return np.asarray(np.take(_LEVEL, step))


def channel_gains(temperature_k: float) -> Light:
    """Return gains (3,) on red, green and blue of a colour temperature, relative to 6500 K.

    The Planckian locus by Kim et al.'s cubic splines (US patent 7,024,034), 1667 to 25,000 K.
    """
    gains = _planckian(temperature_k) / _planckian(DAYLIGHT_K)
    return np.asarray(gains / (LUMINANCE @ gains), np.float32)


def _planckian(temperature_k: float) -> NDArray[np.float64]:
    """Return the linear sRGB colour (3,) of a black body, at luminance 1."""
    inverse = 1e3 / temperature_k
    if temperature_k <= 4000:
        x = np.polyval([-0.2661239, -0.2343589, 0.8776956, 0.179910], inverse)
    else:
        x = np.polyval([-3.0258469, 2.1070379, 0.2226347, 0.240390], inverse)
    if temperature_k <= 2222:
        y = np.polyval([-1.1063814, -1.34811020, 2.18555832, -0.20219683], x)
    elif temperature_k <= 4000:
        y = np.polyval([-0.9549476, -1.37418593, 2.09137015, -0.16748867], x)
    else:
        y = np.polyval([3.0817580, -5.87338670, 3.75112997, -0.37001483], x)
    return np.asarray(_RGB_FROM_XYZ @ [x / y, 1.0, (1 - x - y) / y])


@dataclass(frozen=True)
class LightState:
    """Light of one path."""

    ev: float  # brightness beside the scene's own, stops
    temperature_k: float  # colour temperature; the scene's own is 6500
    wave_vectors: NDArray[np.float64]  # (K, 3) of the smooth change, radians per metre
    phases: NDArray[np.float64]  # (K,) radians
    amplitude_ev: float  # amplitude of each wave, stops
    state: str | None = None  # name in ``STATES``, where the scene's lights are switched

    @property
    def weights(self) -> dict[str, float] | None:
        """Weight of each group of sources; None where they are not switched."""
        return dict(zip(LIGHT_GROUPS, STATES[self.state], strict=True)) if self.state else None

    @property
    def gains(self) -> Light:
        """Factors (3,) on red, green and blue everywhere."""
        return np.asarray(np.exp2(self.ev) * channel_gains(self.temperature_k), np.float32)

    def field(self, points_m: NDArray[np.float32]) -> Light:
        """Return the factors (...) on light at points (..., 3), world, metres."""
        waves = points_m @ self.wave_vectors.T.astype(np.float32)
        waves += self.phases.astype(np.float32)
        return np.asarray(np.exp2(np.float32(self.amplitude_ev) * np.cos(waves).sum(-1)))


def drawn_light(config: LightConfig, rng: np.random.Generator) -> LightState:
    """Draw the light of one path."""
    ev = rng.uniform(*config.ev)
    lowest_k, highest_k = config.temperature_k
    mired = rng.uniform(1e6 / highest_k, 1e6 / lowest_k)
    ways = rng.standard_normal((WAVES, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    lengths_m = config.field_m * rng.uniform(1, 2, WAVES)
    amplitude = config.field_ev * np.sqrt(2 / WAVES)
    phases = rng.uniform(0, 2 * np.pi, WAVES)
    vectors = ways * (2 * np.pi / lengths_m[:, None])
    state = config.states[int(rng.integers(len(config.states)))] if config.states else None
    return LightState(ev, 1e6 / mired, vectors, phases, amplitude, state)


class AutoExposure:
    """Exposure that follows the metering of earlier frames with a first-order lag in stops."""

    def __init__(self, config: ExposureConfig) -> None:
        self._config = config
        self._goal_ev: float | None = None
        self._ev = 0.0

    def next_ev(self, light: Light, since_s: float) -> float:
        """Return the exposure of the next frame; the first frame is taken as settled.

        ``ev = goal + (ev - goal) * exp(-since_s / time_constant_s)``, with the goal of the frame
        before: what a camera meters it can only use later.

        Args:
            light: Linear light (H, W, 3) of the frame, white at 1.
            since_s: Seconds since the last frame.

        Returns:
            The exposure, stops.
        """
        config = self._config
        if config.time_constant_s is None:
            return config.ev
        mean = max(float(light.mean((0, 1), np.float64) @ LUMINANCE), DARKEST)
        now_ev = float(np.clip(math.log2(config.target / mean), -config.most_ev, config.most_ev))
        if self._goal_ev is None:
            self._goal_ev = self._ev = now_ev
        left = math.exp(-since_s / config.time_constant_s)
        self._ev = self._goal_ev + (self._ev - self._goal_ev) * left
        self._goal_ev = now_ev
        return config.ev + self._ev


def with_noise(light: Light, noise: NoiseConfig, rng: np.random.Generator) -> Light:
    """Add shot and read noise: variance ``light / full_well + (read / full_well)^2``.

    The normal approximation of the Poisson-Gaussian model (Foi et al., IEEE TIP 17(10), 2008), in
    which a well that is full holds no more.

    Args:
        light: Linear light (...), white at 1; clipped to 0 to 1 before noise is added.
        noise: Electrons of a full well and of read noise.
        rng: Source of the noise.

    Returns:
        Noisy light (...), which may lie outside 0 to 1.
    """
    signal = np.clip(light, 0, 1)
    variance = signal / np.float32(noise.full_well_e)
    variance += np.float32((noise.read_e / noise.full_well_e) ** 2)
    signal += np.sqrt(variance) * rng.standard_normal(light.shape, np.float32)
    return np.asarray(signal)


def compressed(rgb: Rgb, quality: int) -> Rgb:
    """Compress a frame (H, W, 3) as JPEG and decode it."""
    file = io.BytesIO()
    Image.fromarray(rgb).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))
