"""Progress of a command: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar

from tqdm import tqdm

EVERY_S = 5.0  # between lines
LARGE = 100_000  # counts that a bar shows in thousands


class Outlook:
    """Time left of a command of several stages, which the progress of each shows beside its own.

    Args:
        expected_s: Seconds that each stage takes on a usual machine by its name, in order. The pace
            of the stages that are done scales those to come.
    """

    def __init__(self, expected_s: Mapping[str, float]) -> None:
        self._expected_s = dict(expected_s)
        self._names = list(expected_s)
        self._at = 0
        self._foreseen_s = self._spent_s = 0.0

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count what is done in the block as one of the stages."""
        self._at = self._names.index(name)
        began_s = time.monotonic()
        token = _OUTLOOK.set(self)
        try:
            yield
        finally:
            _OUTLOOK.reset(token)
        self._foreseen_s += self._expected_s[name]
        self._spent_s += time.monotonic() - began_s

    @property
    def place(self) -> str:
        """Number of the stage among all, such as ``2/5``."""
        return f"{self._at + 1}/{len(self._names)}"

    @property
    def later_s(self) -> float:
        """Seconds that the stages after this one will take."""
        pace = self._spent_s / self._foreseen_s if self._foreseen_s else 1.0
        return pace * sum(self._expected_s[name] for name in self._names[self._at + 1 :])


_OUTLOOK: ContextVar[Outlook | None] = ContextVar("outlook", default=None)


def duration_text(seconds: float) -> str:
    """Return a duration as a person says it: ``40 s``, ``12 min``, ``2.5 h``."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


class Progress(tqdm):  # type: ignore[type-arg]
    """Count of what is done, with its rate and the time left, on standard error.

    What is done before the first line is due says nothing.

    Args:
        total: How many there are in all.
        name: What is done with them.
        n_done: How many were done before.
        unit: What one is called.
    """

    def __init__(self, total: int, name: str, n_done: int = 0, *, unit: str = "frame") -> None:
        self._outlook = _OUTLOOK.get()
        if self._outlook is not None:
            name = f"{self._outlook.place} {name}"
        super().__init__(
            total=total,
            initial=n_done,
            unit=unit,
            desc=name,
            leave=False,
            disable=None,
            unit_scale=total >= LARGE,
        )
        # Elsewhere than on terminals tqdm keeps nothing of these.
        self._name, self._units, self._n_all = name, f"{unit}s", total
        self._n_before = self._n_done = n_done
        self._began_s = self._said_s = time.monotonic()

    def update(self, n: float | None = 1) -> bool | None:
        """Count ``n`` more as done."""
        self._n_done += int(n or 0)
        now_s = time.monotonic()
        n_new = self._n_done - self._n_before
        if n_new and now_s - self._said_s >= EVERY_S:
            self._said_s = now_s
            rate = n_new / (now_s - self._began_s)
            left_s = (self._n_all - self._n_done) / rate
            in_all = self._in_all(left_s)
            if self.disable:
                line = f"{self._name}: {self._n_done} of {self._n_all} {self._units}"
                said = f"{line}, {rate:.1f}/s, {left_s:.0f} s left{in_all}"
                print(said, file=sys.stderr, flush=True)
            else:
                self.set_postfix_str(in_all.removeprefix(", "), refresh=False)
        return super().update(n)

    def _in_all(self, left_s: float) -> str:
        """Say how long the stages to come will take as well, if there are any."""
        if self._outlook is None:
            return ""
        return f", {duration_text(left_s + self._outlook.later_s)} in all"

    def part_done(self, name: str, count: int, seconds: float) -> None:
        """Print a line about a finished part where there is no terminal for the bar.

        Args:
            name: The part, such as ``seq-01``.
            count: How many it held.
            seconds: Time that took.
        """
        if self.disable:
            self._said_s = time.monotonic()
            rate = count / seconds if seconds else float("inf")
            line = f"{name}, {count} {self._units} in {seconds:.1f} s, {rate:.1f}/s"
            print(line, file=sys.stderr, flush=True)


@contextmanager
def at_work(name: str, what: str) -> Iterator[None]:
    """Print now and then that work goes on of which nothing can be counted.

    Args:
        name: The command, as in lines of :class:`Progress`.
        what: What it does, such as ``choosing the collision mesh``.
    """
    done, began_s = threading.Event(), time.monotonic()

    def tell() -> None:
        while not done.wait(min(EVERY_S, threading.TIMEOUT_MAX)):
            seconds = time.monotonic() - began_s
            print(f"{name}: {what}, {seconds:.0f} s so far", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()
