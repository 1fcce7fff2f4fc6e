"""One thread for localizing, whose many small computations gain nothing by more.

OpenBLAS spreads the linear algebra of a few hundred matches over all cores, and its threads spin
while they wait for each other: photographs take more processor time then, and no less of the clock.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from threadpoolctl import threadpool_limits


@contextmanager
def single_thread() -> Iterator[None]:
    """Keep tensors and linear algebra to one thread, of linear algebra for as long as this runs."""
    torch.set_num_threads(1)
    with threadpool_limits(limits=1, user_api="blas"):
        yield
