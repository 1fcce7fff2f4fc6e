"""Times of several ways to do the same, taken in turns so that a busy machine slows all alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np


class Taken(NamedTuple):
    """Medians, seconds: on the clock, and of processor time over all threads."""

    wall_s: float
    cpu_s: float


def interleaved(
    ways: dict[str, Callable[[int], object]], rounds: Iterable[int]
) -> dict[str, Taken]:
    """Median times of each way; each is called with each round's number, and once before."""
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in ways}
    for index, number in enumerate([0, *rounds]):
        for name, way in ways.items():
            wall, cpu = time.perf_counter(), time.process_time()
            way(number)
            if index:
                taken[name].append((time.perf_counter() - wall, time.process_time() - cpu))
    return {name: Taken(*np.median(times, axis=0).tolist()) for name, times in taken.items()}
