"""Rendering sequences in this process, or in several that each keep a renderer open."""

from __future__ import annotations

import logging
import multiprocessing
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from logging.handlers import QueueHandler
from multiprocessing.connection import wait as wait_for_end
from pathlib import Path
from typing import Any

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.depth import MILLIMETRES
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.render_sequence import effects_of, write_sequence
from synfeal.effects.scene import SceneRenderer, open_scene
from synfeal.errors import InputError
from synfeal.records.progress import Progress
from synfeal.render.surface import Layers

log = logging.getLogger("synfeal")
POLL_S = 0.2
Task = tuple[Path, PoseTable]  # `seq-01` or `seq-01.zip`, and its poses


@dataclass(frozen=True)
class Studio:
    """Everything that workers need to render frames."""

    mesh: Path
    camera: CameraConfig
    render: RenderConfig
    layers: Layers  # what is written beside colours
    detail: Path | None = None  # what colours are drawn of, if not of ``mesh``

    def open(self) -> SceneRenderer:
        """Open a renderer."""
        return open_scene(self.mesh, self.camera, self.render, self.detail)

    def carry_out(
        self, renderer: SceneRenderer, task: Task, on_frame: Callable[[], object]
    ) -> float:
        """Render a sequence.

        Args:
            renderer: What :meth:`open` returned.
            task: Directory or archive to write, and the poses of its frames.
            on_frame: Called after each frame.

        Returns:
            The seconds it took.
        """
        began, (out, poses) = time.perf_counter(), task
        write_sequence(
            renderer,
            poses,
            out,
            self.layers,
            on_frame,
            effects_of(self.camera, self.render),
            self.camera.stereo_baseline_m,
            self.camera.depth_units_per_m or MILLIMETRES,
        )
        return time.perf_counter() - began


def render_sequences(studio: Studio, tasks: list[Task], workers: int, progress: Progress) -> None:
    """Render all sequences; each appears when it is complete.

    Args:
        studio: What renders them.
        tasks: Directory or archive to write, and the poses of its frames, for each sequence.
        workers: Number of processes, of which no more are started than there are sequences; with
            1, this process renders.
        progress: Advanced by every frame.
    """
    workers = min(workers, len(tasks))
    if workers > 1:
        _render_parallel(studio, tasks, workers, progress)
    elif tasks:
        with studio.open() as renderer:
            for task in tasks:
                seconds = studio.carry_out(renderer, task, progress.update)
                progress.part_done(task[0].name, len(task[1]), seconds)


def _render_parallel(studio: Studio, tasks: list[Task], workers: int, progress: Progress) -> None:
    context = multiprocessing.get_context("spawn")  # a forked OpenGL context does not work
    n_done, stop = context.Value("q", 0), context.Event()
    initial = (studio, workers, n_done, stop, log.getEffectiveLevel())
    executor = ProcessPoolExecutor(workers, context, _start_worker, initial)
    try:
        running = {executor.submit(_carry_out, task): task for task in tasks}
        n_shown = 0
        while running:
            ended, _ = wait(running, POLL_S, FIRST_COMPLETED)
            n_seen = n_done.value
            progress.update(n_seen - n_shown)
            n_shown = n_seen
            for future in ended:
                out, poses = running.pop(future)
                seconds, records = future.result()
                _log_here(records)
                progress.part_done(out.name, len(poses), seconds)
    except BrokenProcessPool as error:
        raise InputError(
            "collect",
            "a worker process was killed, perhaps for lack of memory",
            "what is done is kept: run the same command again, with fewer `cores`",
        ) from error
    finally:
        stop.set()
        executor.shutdown(cancel_futures=True)


def _log_here(records: list[logging.LogRecord]) -> None:
    """Log what a worker process said, by the handlers and levels of this process."""
    for record in records:
        logger = logging.getLogger(record.name)
        if logger.isEnabledFor(record.levelno):
            logger.handle(record)


_worker: dict[str, Any] = {}  # what a worker process keeps between sequences


def _start_worker(studio: Studio, workers: int, n_done: Any, stop: Any, level: int) -> None:
    """Set up a worker process that ends with its parent and leaves Ctrl-C to it.

    Args:
        studio: What renders.
        workers: Number of processes.
        n_done: Counter of frames that all of them share.
        stop: Event that ends them.
        level: Least level of log lines, which are kept for the parent: it knows how to word them.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Read by Mesa's software renderer when it starts.
    cpus = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    os.environ.setdefault("LP_NUM_THREADS", str(max(1, cpus // workers)))

    def on_frame() -> None:
        with n_done.get_lock():
            n_done.value += 1
        if stop.is_set():  # another worker failed, or the person interrupted
            raise InputError("collect", "stopped")

    said: queue.SimpleQueue[logging.LogRecord] = queue.SimpleQueue()
    logging.getLogger().addHandler(QueueHandler(said))
    logging.getLogger().setLevel(level)
    _worker.update(studio=studio, on_frame=on_frame, said=said)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait_for_end([parent.sentinel])
    os._exit(1)


def _carry_out(task: Task) -> tuple[float, list[logging.LogRecord]]:
    """Render a sequence; return the seconds it took, and what was logged meanwhile."""
    studio, said = _worker["studio"], _worker["said"]
    if "renderer" not in _worker:
        _worker["renderer"] = studio.open()
    seconds = studio.carry_out(_worker["renderer"], task, _worker["on_frame"])
    return seconds, [said.get() for _ in range(said.qsize())]
