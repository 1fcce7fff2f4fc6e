"""The light of a path: brightness, colour temperature, and a smooth change across the scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.config.effects import LightConfig
from synfeal.effects.camera import channel_gains
from synfeal.effects.transfer import Light

WAVES = 6
GROUPS = ("ambient", "lamps", "daylight")
# Weights of the groups; `lamps` and `daylight` add up to the scene's own light.
STATES: dict[str, tuple[float, float, float]] = {
    "all": (1.0, 1.0, 1.0),
    "lamps": (0.5, 1.0, 0.0),
    "daylight": (0.5, 0.0, 1.0),
    "dusk": (0.25, 1.0, 0.15),
    "night": (0.05, 0.1, 0.0),
}


@dataclass(frozen=True)
class LightState:
    """What the light of a path is."""

    ev: float  # brightness beside the scene's own, stops
    temperature_k: float  # colour temperature; the scene's own is 6500
    wave_vectors: NDArray[np.float64]  # (K, 3) of the smooth change, radians per metre
    phases: NDArray[np.float64]  # (K,) radians
    amplitude_ev: float  # of each of its waves, stops
    state: str | None = None  # name in ``STATES``, where the scene's lights are switched

    @property
    def weights(self) -> dict[str, float] | None:
        """Of the groups of sources, where they are switched."""
        return dict(zip(GROUPS, STATES[self.state], strict=True)) if self.state else None

    @property
    def gains(self) -> Light:
        """Factors (3,) on red, green and blue everywhere."""
        return np.asarray(np.exp2(self.ev) * channel_gains(self.temperature_k), np.float32)

    def field(self, points_m: NDArray[np.float32]) -> Light:
        """Factors (...) at points (..., 3) of the world."""
        waves = points_m @ self.wave_vectors.T.astype(np.float32)
        waves += self.phases.astype(np.float32)
        return np.asarray(np.exp2(np.float32(self.amplitude_ev) * np.cos(waves).sum(-1)))


def drawn_light(config: LightConfig, rng: np.random.Generator) -> LightState:
    """The light of one path."""
    ev = rng.uniform(*config.ev)
    coldest, warmest = config.temperature_k
    mired = rng.uniform(1e6 / warmest, 1e6 / coldest)
    ways = rng.standard_normal((WAVES, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    lengths_m = config.field_m * rng.uniform(1, 2, WAVES)
    amplitude = config.field_ev * np.sqrt(2 / WAVES)
    phases = rng.uniform(0, 2 * np.pi, WAVES)
    vectors = ways * (2 * np.pi / lengths_m[:, None])
    state = config.states[int(rng.integers(len(config.states)))] if config.states else None
    return LightState(ev, 1e6 / mired, vectors, phases, amplitude, state)
