"""How far a rendering is: a bar on a terminal, one line per sequence in a log."""

from __future__ import annotations

import sys
from typing import Self

from tqdm import tqdm


class Progress:
    """Frames done of all that are to be rendered; everything goes to standard error."""

    def __init__(self, n_frames: int, name: str, n_done: int = 0) -> None:
        self._on_terminal = sys.stderr.isatty()
        self._bar = tqdm(total=n_frames, initial=n_done, unit="frame", desc=name, disable=None)

    def update(self, n_frames: int = 1) -> None:
        """Some more frames are done."""
        self._bar.update(n_frames)

    def part_done(self, name: str, n_frames: int, seconds: float) -> None:
        """One sequence is done; says so where there is no bar."""
        if not self._on_terminal:
            rate = n_frames / seconds if seconds else float("inf")
            line = f"{name}, {n_frames} frames in {seconds:.1f} s, {rate:.1f}/s"
            print(line, file=sys.stderr, flush=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()
