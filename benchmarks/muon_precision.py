"""Error of Muon's steps when a GPU rounds the factors of its matrix products.

    python -m benchmarks.muon_precision --out results/benchmarks/muon_precision.csv

Tensor cores round the factors of a product, to ten bits of mantissa (TF32) or to seven (bfloat16),
and add in float32. Here the factors are rounded on a processor, in the products around the
iterations (a gradient with itself, and the root with the gradient), in the iterations, or in both.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import torch
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode

from baselines.training.optimizer import ITERATIONS, LOWEST
from baselines.training.polar import inverse_square_root, quintics_for
from synfeal.errors import exit_status
from synfeal.records.tables import write_frame

MANTISSA_BITS = {"tf32": 10, "bfloat16": 7}
# A first convolution, one in the middle, one at the end of GoogLeNet, a fully connected layer.
SHAPES = ((64, 147), (128, 1152), (384, 1728), (1024, 2048))
# Decades that the singular values of a gradient span; 0: those of normal deviates.
DECADES = (0, 4)


class PrecisionRow(NamedTuple):
    """Error of a step, relative to the same step in float32."""

    rows: int
    columns: int
    decades: int
    factors: str
    rounded_in: str
    error: float


class RoundedProducts(TorchDispatchMode):  # type: ignore[no-untyped-call]
    """Rounds the factors of every matrix product to so many bits."""

    def __init__(self, bits: int) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._bits = bits

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):  # type: ignore[no-untyped-def]
        names = {torch.ops.aten.mm: 0, torch.ops.aten.bmm: 0, torch.ops.aten.baddbmm: 1}
        first = names.get(func.overloadpacket)
        if first is not None:
            factors = (rounded(x, self._bits) for x in args[first : first + 2])
            args = (*args[:first], *factors)
        return func(*args, **(kwargs or {}))


def rounded(values: Tensor, bits: int) -> Tensor:
    """Round float32 values to the nearest with so many bits of mantissa."""
    dropped = 23 - bits
    raised = values.contiguous().view(torch.int32) + (1 << (dropped - 1))
    return (raised & ~((1 << dropped) - 1)).view(torch.float32)


def gradient_of(rows: int, columns: int, decades: int) -> Tensor:
    """Draw a matrix of normal deviates, with other singular values unless ``decades`` is 0."""
    drawn = torch.randn(rows, columns, generator=torch.Generator().manual_seed(rows))
    if not decades:
        return drawn
    left, _, right = torch.linalg.svd(drawn, full_matrices=False)
    gradient: Tensor = (left * torch.logspace(0, -decades, rows)) @ right
    return gradient


def step_of(gradient: Tensor, around: int | None, within: int | None) -> Tensor:
    """Compute Muon's step of a gradient.

    Args:
        gradient: Matrix (rows, columns), no more rows than columns.
        around: Bits of the factors around the iterations; None rounds nothing.
        within: Bits of the factors in the iterations.
    """
    gram = _products(around, lambda: gradient @ gradient.mT)
    quintics = quintics_for(LOWEST, ITERATIONS)
    root = _products(within, lambda: inverse_square_root(gram[None], quintics)[0])
    return _products(around, lambda: root @ gradient)


def _products(bits: int | None, work: Callable[[], Tensor]) -> Tensor:
    if bits is None:
        return work()
    with RoundedProducts(bits):
        return work()


def measure() -> Iterator[PrecisionRow]:
    """Measure every shape, spectrum and rounding."""
    for rows, columns in SHAPES:
        for decades in DECADES:
            gradient = gradient_of(rows, columns, decades)
            exact = step_of(gradient, None, None)
            for factors, bits in MANTISSA_BITS.items():
                places = {"around": (bits, None), "within": (None, bits), "both": (bits, bits)}
                for place, chosen in places.items():
                    error = float((step_of(gradient, *chosen) - exact).norm() / exact.norm())
                    yield PrecisionRow(rows, columns, decades, factors, place, error)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.muon_precision")
    parser.add_argument("--out", type=Path, required=True, help="CSV to write")
    options = parser.parse_args(arguments)

    def run() -> None:
        table = pd.DataFrame(measure())
        write_frame(options.out, table, "%.4g")
        print(table.to_string(index=False))

    return exit_status(run, "nothing was written")


if __name__ == "__main__":
    sys.exit(main())
