"""What a piece of work takes: seconds of the processor, and memory."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
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
    facts["peak_memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
