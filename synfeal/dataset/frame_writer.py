"""Frames are encoded and written on threads while the next ones are rendered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.png import encode_png
from synfeal.dataset.sevenscenes import depth_mm_of, pose_text
from synfeal.render.base import Depth, Rgb

THREADS = 4
MOST_WAITING = 2 * THREADS  # frames in memory, whatever the length of the sequence


class FrameWriter:
    """Writes the files of frames; what went wrong on a thread is raised by the next call.

    The directory they are written to gets its name when they are whole, so they need no temporary
    ones. Leaving the context waits for what is under way.
    """

    def __init__(self, on_frame: Callable[[], object] = lambda: None) -> None:
        """Call ``on_frame`` for each frame that is whole."""
        self._on_frame = on_frame
        self._threads = ThreadPoolExecutor(THREADS, thread_name_prefix="frames")
        self._waiting: deque[Future[None]] = deque()

    def add(
        self, stem: Path, world_from_cam: NDArray[np.float64], rgb: Rgb, depth_m: Depth | None
    ) -> None:
        """Write ``<stem>.color.png``, ``.pose.txt`` and, with depth, ``.depth.png``.

        Waits while too many frames are under way.

        Raises:
            OSError: an earlier frame could not be written.
        """
        while len(self._waiting) >= MOST_WAITING:
            self._finish_one()
        self._waiting.append(self._threads.submit(self._write, stem, world_from_cam, rgb, depth_m))

    def _write(
        self, stem: Path, world_from_cam: NDArray[np.float64], rgb: Rgb, depth_m: Depth | None
    ) -> None:
        if depth_m is not None:
            stem.with_suffix(".depth.png").write_bytes(encode_png(depth_mm_of(depth_m)))
        stem.with_suffix(".pose.txt").write_bytes(pose_text(world_from_cam).encode())
        stem.with_suffix(".color.png").write_bytes(encode_png(rgb))

    def _finish_one(self) -> None:
        self._waiting.popleft().result()
        self._on_frame()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            while kind is None and self._waiting:
                self._finish_one()
        finally:
            self._threads.shutdown(cancel_futures=True)
