"""Progress of a command: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time

from tqdm import tqdm

EVERY_S = 5.0  # between lines


class Progress(tqdm):  # type: ignore[type-arg]
    """Count of what is done, with its rate and the time left, on standard error.

    What is done before the first line is due says nothing.
    """

    def __init__(self, total: int, unit: str, name: str) -> None:
        """Take how many there are in all, what one is called, and what is done with them."""
        super().__init__(total=total, unit=unit, desc=name, leave=False, disable=None)
        # Elsewhere than on terminals tqdm keeps nothing of these.
        self._name, self._units, self._n_all, self._n_done = name, f"{unit}s", total, 0
        self._began_s = self._said_s = time.monotonic()

    def update(self, n: float | None = 1) -> bool | None:
        """Count ``n`` more as done."""
        self._n_done += int(n or 0)
        now_s = time.monotonic()
        if self.disable and now_s - self._said_s >= EVERY_S:
            self._said_s = now_s
            rate = self._n_done / (now_s - self._began_s)
            left_s = (self._n_all - self._n_done) / rate
            line = f"{self._name}: {self._n_done} of {self._n_all} {self._units}"
            print(f"{line}, {rate:.1f}/s, {left_s:.0f} s left", file=sys.stderr, flush=True)
        return super().update(n)
