"""Duration of a training step, in this tree and in another one, measured by turns.

    python -m benchmarks.step_time --before ../another-checkout --out steps.csv

Both trees take some steps, one after the other, many times: whatever else the machine does
meanwhile slows both alike, and the ratio of the two is that of neighbours in time.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from baselines.config.learning import MODELS
from synfeal.errors import InputError, exit_status
from synfeal.records.tables import write_frame

HERE = Path(__file__).resolve().parents[1]
WORKER = Path(__file__).with_name("step_worker.py")
RESAMPLES = 2000


class Worker:
    """A process that takes training steps with the code of one tree."""

    def __init__(self, tree: Path, model: str, profile: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, WORKER, model, profile.resolve()],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=tree,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def seconds(self, steps: int) -> float:
        """Measure the mean processor seconds of a step over so many."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{steps}\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise InputError("a tree cannot take training steps; what it says stands above")
        return float(answer) / steps


class StepTime(NamedTuple):
    """One row of the table; times are medians over the rounds."""

    model: str
    before_ms: float
    after_ms: float
    ratio: float  # median over the rounds
    ratio_low: float  # 95 % limits, by resampling the rounds
    ratio_high: float
    rounds: int


def compare(model: str, before: Path, profile: Path, rounds: int, steps: int) -> StepTime:
    """Measure one localizer in both trees by turns.

    Args:
        model: Name of the localizer.
        before: Root of the other tree.
        profile: Configuration that both train with.
        rounds: Number of turns of each tree.
        steps: Training steps of a turn.
    """
    with ExitStack() as stack:
        workers = [stack.enter_context(Worker(tree, model, profile)) for tree in (before, HERE)]
        for worker in workers:
            worker.seconds(steps)  # the first steps set up what later ones keep
        turns = [[worker.seconds(steps) for worker in workers] for _ in range(rounds)]
    seconds = np.array(turns)  # (rounds, 2)
    ratios = seconds[:, 1] / seconds[:, 0]
    low, high = median_interval(ratios)
    before_ms, after_ms = 1e3 * np.median(seconds, axis=0)
    ratio = float(np.median(ratios))
    return StepTime(model, float(before_ms), float(after_ms), ratio, low, high, rounds)


def median_interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Compute 95 % limits of the median of values (N,) by the bootstrap."""
    drawn = np.random.default_rng(0).choice(values, (RESAMPLES, len(values)))
    low, high = np.percentile(np.median(drawn, axis=1), [2.5, 97.5])
    return float(low), float(high)


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.step_time", description=__doc__)
    parser.add_argument("--before", type=Path, required=True, help="root of the other tree")
    parser.add_argument("--models", nargs="+", default=MODELS, help="(all five)")
    parser.add_argument(
        "--profile", type=Path, default=HERE / "config/config.yaml", help="(config/config.yaml)"
    )
    parser.add_argument("--rounds", type=int, default=15, help="turns of each tree (15)")
    parser.add_argument("--steps", type=int, default=4, help="training steps of a turn (4)")
    parser.add_argument("--out", type=Path, help="CSV to write")
    return parser


def run(options: argparse.Namespace) -> None:
    """Measure, print, and write the table.

    Raises:
        InputError: the other tree is none, or cannot take training steps.
    """
    before = options.before.resolve()
    if not (before / "baselines/training/fit.py").is_file():
        raise InputError(f"{before}: holds no baselines/training; name the root of a checkout")
    rows = []
    for model in options.models:
        rows.append(compare(model, before, options.profile, options.rounds, options.steps))
        print(pd.DataFrame(rows[-1:]).to_string(index=False, header=len(rows) == 1), flush=True)
    if options.out:
        write_frame(options.out, pd.DataFrame(rows))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "nothing was written")


if __name__ == "__main__":
    sys.exit(main())
