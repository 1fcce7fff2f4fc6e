"""Progress of a command: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time

from tqdm import tqdm

EVERY_S = 5.0  # between lines
LARGE = 100_000  # counts that a bar shows in thousands


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
        if self.disable and n_new and now_s - self._said_s >= EVERY_S:
            self._said_s = now_s
            rate = n_new / (now_s - self._began_s)
            left_s = (self._n_all - self._n_done) / rate
            line = f"{self._name}: {self._n_done} of {self._n_all} {self._units}"
            print(f"{line}, {rate:.1f}/s, {left_s:.0f} s left", file=sys.stderr, flush=True)
        return super().update(n)

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
