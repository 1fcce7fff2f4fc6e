"""Processor time and memory of a piece of work."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

Facts = dict[str, float]


@contextmanager
def timed(facts: Facts, name: str) -> Iterator[None]:
    """Note the processor time of the block as ``name``.

    Beside it, as ``peak_memory_mb``, the most memory this process has held so far.
    """
    begin = time.process_time()
    yield
    facts[name] = time.process_time() - begin
    facts["peak_memory_mb"] = peak_memory_mb()


def peak_memory_mb() -> float:
    """Return the most memory that this process has held so far; NaN on Windows."""
    if sys.platform == "win32":
        return math.nan
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024**2 if sys.platform == "darwin" else 1024)


def seconds_of(works: Iterable[Callable[[], object]], of_processor: bool = False) -> list[float]:
    """Run pieces of work in turn and return the seconds of each, wall clock or processor."""
    now = time.process_time if of_processor else time.perf_counter
    seconds = []
    for work in works:
        began = now()
        work()
        seconds.append(now() - began)
    return seconds
