"""Device and precision of networks, and the settings of the processor."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

import torch

from synfeal.errors import Argument, InputError

Precision = Literal["float32", "bfloat16"]


def open_device(wanted: Literal["auto", "cpu", "cuda"]) -> torch.device:
    """Return the device to work on; ``auto`` takes the GPU if there is one.

    On the CPU one thread is used: two runs side by side are faster than one on two threads,
    and one thread adds up in one order, so the same seed gives the same network. Denormal numbers
    are flushed to zero; they carry no information and take many times as long.

    Raises:
        InputError: ``cuda`` is asked for and not there.
    """
    if wanted == "cuda" and not torch.cuda.is_available():
        raise InputError(
            Argument("device"), "'cuda' is asked for, but torch finds no GPU", "use 'auto'"
        )
    if wanted != "cpu" and torch.cuda.is_available():
        return torch.device("cuda")
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    return torch.device("cpu")


def precision_on(device: torch.device, wanted: Literal["auto", "float32", "bfloat16"]) -> Precision:
    """Choose the precision of networks; ``auto`` is bfloat16 where the device multiplies in it.

    Those are GPUs, and processors with AVX512-BF16 or AMX, where a step takes 0.6 to 0.9 times as
    long; elsewhere it would be emulated.
    """
    if wanted != "auto":
        return wanted
    found = torch.cpu.get_capabilities()
    native = bool(found.get("avx512_bf16") or found.get("amx_bf16"))
    return "bfloat16" if device.type == "cuda" or native else "float32"


def autocast(device: torch.device, precision: Precision) -> torch.autocast:
    """Return a context in which networks compute in this precision; weights stay in float32."""
    return torch.autocast(device.type, torch.bfloat16, enabled=precision == "bfloat16")


@contextmanager
def tensor_float32(device: torch.device) -> Iterator[None]:
    """Let a GPU round the factors of float32 matrix products to ten bits, which is faster.

    On a processor nothing changes.
    """
    before = torch.get_float32_matmul_precision()
    if device.type == "cuda":
        torch.set_float32_matmul_precision("high")
    try:
        yield
    finally:
        if device.type == "cuda":
            torch.set_float32_matmul_precision(before)
