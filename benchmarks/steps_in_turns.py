"""Processor time of training steps of this code and of other code, measured in turns.

    git worktree add ../before COMMIT
    python -m benchmarks.steps_in_turns ../before --out results/benchmarks/steps_in_turns.csv

Both train the same networks on the same noise, a few steps at a time, in two processes that wait
for each other: what else a machine does slows both. Compared is processor time.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from synfeal.errors import InputError, exit_status
from synfeal.records.provenance import git_commit
from synfeal.records.tables import write_frame

ROOT = Path(__file__).resolve().parents[1]
PLAIN = " without auxiliary regressors"
CASES = ("posenet", "hourglass", "posenet2resnet", "posenet2", "posenet2" + PLAIN)
INPUT_PX, WIDTH, BATCH, FRAMES = 64, 0.25, 64, 128


class Trainee:
    """Code that trains, in a process of its own.

    Args:
        tree: Working tree of the code.
        steps: Steps to take at a time.
    """

    def __init__(self, tree: Path, steps: int) -> None:
        command = [sys.executable, __file__, str(tree), "--work", "--steps", str(steps)]
        environment = os.environ | {"PYTHONPATH": str(tree)}
        self._process = subprocess.Popen(
            command,
            cwd=tree,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.commit = git_commit(tree)

    def step_ms(self, case: str) -> float:
        """Take the steps, and return the processor time of one, milliseconds.

        Args:
            case: One of ``CASES``.

        Raises:
            InputError: The process has ended.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(case, file=self._process.stdin, flush=True)
        answer = self._process.stdout.readline()
        if not answer:
            raise InputError(self.commit, "this code could not train; what it said stands above")
        return float(answer)

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


def work(steps: int) -> None:
    """Read cases, and answer with the processor time of a step of each, milliseconds.

    Imports what is on the path, and nothing that the other code may not have.
    """
    import torch
    from torch.nn.functional import normalize

    from baselines.config.learning import NetworkConfig
    from baselines.localizers.registry import build_localizer
    from baselines.training.data import LabelledFrames, image_statistics
    from baselines.training.device import open_device, precision_on
    from baselines.training.fit import fit
    from baselines.training.optimizer import Schedule
    from baselines.training.train import recipe_of

    device = open_device("cpu")
    torch.manual_seed(0)
    images = torch.randint(0, 256, (FRAMES, 3, INPUT_PX, INPUT_PX), dtype=torch.uint8)
    frames = LabelledFrames(
        images=images,
        position_m=torch.randn(FRAMES, 3),
        quat_wxyz=normalize(torch.randn(FRAMES, 4), dim=1),
        path=np.arange(FRAMES, dtype=np.int64),
        rows=torch.arange(FRAMES),
    )
    network = NetworkConfig(input_px=INPUT_PX, width=WIDTH, view="whole")
    for line in sys.stdin:
        name = line.strip().removesuffix(PLAIN)
        hyper = recipe_of(name)
        if line.strip().endswith(PLAIN) and "auxiliary" in type(hyper).model_fields:
            hyper = hyper.model_copy(update={"auxiliary": False})
        localizer = build_localizer(name, network, hyper)
        localizer.place_on(device)
        schedule = Schedule(
            samples_seen=steps * BATCH,
            batch_size=BATCH,
            learning_rate=hyper.learning_rate,
            weight_decay=hyper.weight_decay,
        )
        began = time.process_time()
        fit(
            localizer,
            frames,
            image_statistics(frames.images),
            schedule,
            0,
            precision=precision_on(device, "auto"),
        )
        print(1e3 * (time.process_time() - began) / steps, flush=True)


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.steps_in_turns", description=__doc__
    )
    parser.add_argument("before", type=Path, help="working tree of the other code")
    parser.add_argument("--turns", type=int, default=7, help="of each (7)")
    parser.add_argument("--steps", type=int, default=6, help="of a turn (6)")
    parser.add_argument("--out", type=Path, help="CSV to write")
    parser.add_argument("--work", action="store_true", help=argparse.SUPPRESS)
    return parser


def run(options: argparse.Namespace) -> None:
    """Measure in turns, print medians and their ratio, and write the table."""
    if options.work:
        work(options.steps)
        return
    before, after = trainees = [Trainee(tree, options.steps) for tree in (options.before, ROOT)]
    rows = []
    try:
        for case in CASES:
            for trainee in trainees:
                trainee.step_ms(case)  # not counted: the first one loads libraries
            times = np.array(
                [[trainee.step_ms(case) for trainee in trainees] for _ in range(options.turns)]
            )
            before_ms, after_ms = np.median(times, axis=0)
            low, ratio, high = np.quantile(times[:, 1] / times[:, 0], [0.25, 0.5, 0.75])
            row = {
                "localizer": case,
                "input_px": INPUT_PX,
                "width": WIDTH,
                "batch": BATCH,
                "turns": options.turns,
                "steps_per_turn": options.steps,
                "before_ms": before_ms,
                "after_ms": after_ms,
                "ratio": ratio,
                "ratio_low": low,
                "ratio_high": high,
                "before": before.commit,
                "after": after.commit,
            }
            rows.append(row)
            print(f"{case:40} {before_ms:7.1f} {after_ms:7.1f} ms  x{ratio:.3f}", flush=True)
            if options.out:
                write_frame(options.out, pd.DataFrame(rows), "%.4g")
    finally:
        for trainee in trainees:
            trainee.end()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
