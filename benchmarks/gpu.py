"""Images that a GPU learns from in a second, by localizer, size, batch and kind of step.

    python -m benchmarks.gpu --out results/benchmarks/gpu_here.csv

It needs no data and no network: frames are noise, which costs what pictures cost. Cases are
measured in a process of their own. Where one ends it (by an error that leaves a GPU unusable), a
new one goes on with the case after it, and the missing one is named.

A step is ``captured`` as training takes it on a GPU, or ``plain``. Several processes at a time
show how many runs one card bears.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import takewhile
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Literal

import pandas as pd

from benchmarks.gpu_cases import CASES, TOY_CASES, Case, Machine, Rate
from synfeal.errors import InputError, exit_status
from synfeal.records.tables import write_frame

# Processes are forked from one that has loaded torch and not yet touched a GPU.
PROCESSES = multiprocessing.get_context("forkserver")
PROCESSES.set_forkserver_preload(["benchmarks.gpu_steps"])
Answer = tuple[Rate, Machine]
Device = Literal["auto", "cpu", "cuda"]


def measure(
    cases: Sequence[Case], device: Device, seconds: float, most_seconds: float = 220.0
) -> Iterator[tuple[Case, Rate, Machine]]:
    """Measure cases in processes of their own; yields those that were not lost.

    Args:
        cases: Cases.
        device: ``auto``, ``cpu`` or ``cuda``.
        seconds: Time that the steps of a case are counted for.
        most_seconds: Time after which cases are given up.

    Raises:
        InputError: There is no such device.
    """
    until = time.monotonic() + most_seconds
    left = deque(cases)
    while left:
        alone = list(takewhile(lambda case: case.processes == 1, left))
        # Several processes would not begin a second case at the same time.
        batch = alone or [left[0]]
        answers = _answers(batch, device, seconds, until)
        for _ in batch:
            answer = next(answers, None)
            case = left.popleft()
            if answer is not None:
                yield case, *answer
            elif time.monotonic() < until:
                print(f"lost: {case}; what it said stands above", file=sys.stderr)
                break  # a new process for the cases after it
            else:
                for missing in (case, *left):
                    print(f"not measured in {most_seconds:.0f} s: {missing}", file=sys.stderr)
                return


def _answers(
    batch: Sequence[Case], device: Device, seconds: float, until: float
) -> Iterator[Answer]:
    """Measure cases one after the other, in as many processes as they ask for, until one is lost.

    Args:
        batch: Cases with the same number of processes.
        device: ``auto``, ``cpu`` or ``cuda``.
        seconds: Time that the steps of a case are counted for.
        until: Time of the monotonic clock at which to end.
    """
    processes = batch[0].processes
    # Setting up does not always take the same time: several measure for longer than it differs.
    counted_s = seconds if processes == 1 else 3 * seconds
    with ExitStack() as stack:
        workers = [stack.enter_context(_worker(batch, device, counted_s)) for _ in range(processes)]
        for _ in batch:
            answers = [_answer(worker, until) for worker in workers]
            if None in answers:
                return
            yield _together([answer for answer in answers if answer is not None])


def _together(answers: Sequence[Answer]) -> Answer:
    """Return the rate of several processes together, and their machine."""
    rates = [rate for rate, _ in answers]
    together = Rate(
        images_per_s=sum(rate.images_per_s for rate in rates),
        step_ms=max(rate.step_ms for rate in rates),
        memory_mb=max(rate.memory_mb for rate in rates),
    )
    return together, answers[0][1]


@contextmanager
def _worker(cases: Sequence[Case], device: Device, seconds: float) -> Iterator[Connection]:
    """Start a process that measures cases, and end it after the block."""
    answers, sender = PROCESSES.Pipe(duplex=False)
    process = PROCESSES.Process(target=_work, args=(cases, device, seconds, sender), daemon=True)
    process.start()
    sender.close()  # the process has its own: when it ends, so do the answers
    try:
        yield answers
    finally:
        process.kill()
        process.join()
        answers.close()


def _work(cases: Sequence[Case], device: Device, seconds: float, sender: Connection) -> None:
    """Measure cases, in a process of its own."""
    from baselines.training.device import open_device
    from benchmarks.gpu_steps import machine_of, rate_of

    try:
        opened = open_device(device)
        for case in cases:
            sender.send((rate_of(case, opened, seconds), machine_of(opened)))
    except InputError as error:
        sender.send(error)


def _answer(answers: Connection, until: float) -> Answer | None:
    """Receive what was measured; None where the process ended or took too long."""
    try:
        if not answers.poll(max(0.0, until - time.monotonic())):
            return None
        answer: Answer | InputError = answers.recv()
    except EOFError:
        return None
    if isinstance(answer, InputError):
        raise answer
    return answer


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu", description=__doc__)
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--seconds", type=float, default=3.0, help="of every case (3)")
    parser.add_argument("--most-seconds", type=float, default=220.0, help="of all cases (220)")
    parser.add_argument("--toy", action="store_true", help="few small cases, to try the command")
    parser.add_argument("--out", type=Path, help="CSV to write")
    return parser


def run(options: argparse.Namespace) -> None:
    """Measure, print, and write the table after every case.

    Raises:
        InputError: Nothing could be measured.
    """
    rows = []
    cases = TOY_CASES if options.toy else CASES
    found = measure(cases, options.device, options.seconds, options.most_seconds)
    for case, rate, machine in found:
        rows.append({**case._asdict(), **rate._asdict(), **machine._asdict()})
        print(f"{rate.images_per_s:9,.0f} images/s  {rate.step_ms:7.2f} ms  {case}", flush=True)
        if options.out:
            write_frame(options.out, pd.DataFrame(rows), "%.5g")
    if not rows:
        raise InputError("no case could be measured; what went wrong stands above")
    print(", ".join(f"{name} {value}" for name, value in machine._asdict().items() if value))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
