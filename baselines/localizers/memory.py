"""Recognise the errors by which torch reports that memory is used up."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

# From the messages of torch's RuntimeErrors on a processor whose memory is used up.
CPU_MEMORY_IS_OUT = ("DefaultCPUAllocator", "could not create a memory", "std::bad_alloc")


def is_out_of_memory(error: BaseException) -> bool:
    """Return whether an error reports a lack of memory, on the processor or on a GPU."""
    if isinstance(error, MemoryError | torch.OutOfMemoryError):
        return True
    text = str(error)
    return isinstance(error, RuntimeError) and any(words in text for words in CPU_MEMORY_IS_OUT)


@contextmanager
def memory_errors() -> Iterator[None]:
    """Turn torch's reports of a lack of memory into ``MemoryError``.

    Raises:
        MemoryError: The block ran out of memory.
    """
    try:
        yield
    except RuntimeError as error:
        if not is_out_of_memory(error):
            raise
        first_line = str(error).partition("\n")[0]
        raise MemoryError(first_line.rpartition("DefaultCPUAllocator: ")[2]) from error
