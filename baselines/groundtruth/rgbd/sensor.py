"""Depth as a structured-light camera measures it.

A Kinect measures disparity: inverse depth in steps of fixed size, with noise of about half a step
that grows with the square of the depth once it is converted (Khoshelham and Elberink, Sensors
12(2), 2012). Noise is independent from pixel to pixel; the wrong depth that
real sensors show along edges is not modelled.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.archive import FrameFile
from synfeal.seeds import generator_of

# One step of normalised disparity (1/m) and the standard deviation of the noise, in steps.
STEP_PER_M, NOISE_STEPS = 2.85e-3, 0.5
# Outside this range (metres) the sensor sees nothing.
RANGE_M = (0.5, 4.5)


def kinect_depth(depth_m: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """What a Kinect measures where the depth is ``depth_m`` (H, W); inf where it sees nothing."""
    near_m, far_m = RANGE_M
    steps = 1 / (depth_m.astype(np.float64) * STEP_PER_M)
    steps = np.maximum(np.round(steps + rng.normal(0, NOISE_STEPS, depth_m.shape)), 1)
    seen = (depth_m >= near_m) & (depth_m <= far_m)
    return np.where(seen, 1 / (steps * STEP_PER_M), np.inf).astype(np.float32)


def frame_generator(seed: int, path: FrameFile) -> np.random.Generator:
    """Noise of one image: the same wherever it is read, for batches share a frame."""
    return generator_of(seed, "depth-sensor", path.parent.name, path.name)
