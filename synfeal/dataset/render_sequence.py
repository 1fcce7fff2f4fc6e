"""Rendering what one job of the workflow makes: a sequence of files, or packed frames."""

from __future__ import annotations

import tempfile
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.config.models import CameraConfig, EffectsConfig, RenderConfig
from synfeal.dataset.archive import is_archive, write_archive
from synfeal.dataset.directories import atomic_directory, refuse_existing, writing_to
from synfeal.dataset.packed import View, fit_frame, new_packed
from synfeal.dataset.png import encode_png
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.progress import Progress, Stopwatch
from synfeal.dataset.sevenscenes import depth_mm_of, pose_text
from synfeal.effects.apply import Frame, varied_frames
from synfeal.effects.relight import open_scene
from synfeal.files import write_json
from synfeal.render.base import Depth, Renderer, Rgb
from synfeal.render.choose import fastest_working

Effects = tuple[CameraConfig, EffectsConfig]
REMEDY = "nothing was kept; fix that and render again"


def render_sequence(
    mesh_path: Path,
    camera: CameraConfig,
    poses: PoseTable,
    out: Path,
    with_depth: bool,
    render: RenderConfig | None = None,
) -> None:
    """Render every pose of the table into a new sequence, which appears when it is complete.

    Frames are numbered from 0 inside the sequence. ``mesh_path`` is a mesh in the world frame, as
    :func:`synfeal.mesh.save.save_glb` writes it. ``out`` is a directory, or an archive if its name
    ends in ``.zip``.

    Raises:
        InputError: the mesh cannot be read, or ``out`` is not empty.
    """
    watch = Stopwatch()
    with (
        writing_to(out, lambda: REMEDY),
        open_scene(mesh_path, camera, render) as renderer,
        Progress(len(poses), out.name) as progress,
    ):
        write_sequence(
            renderer, poses, out, with_depth, progress.update, effects_of(camera, render)
        )
    progress.part_done(out.name, len(poses), watch.seconds)


def write_sequence(
    renderer: Renderer,
    poses: PoseTable,
    out: Path,
    with_depth: bool,
    on_frame: Callable[[], object] = lambda: None,
    effects: Effects | None = None,
) -> None:
    """Render every pose of the table; files are written while the next frames are rendered.

    Raises:
        OSError: a file cannot be written.
    """
    with _new_sequence(out) as directory, FrameWriter(on_frame) as writer:
        frames = drawn(renderer, poses, with_depth, effects)
        for number, (pose, frame) in enumerate(zip(poses.world_from_cam, frames, strict=True)):
            writer.add(directory / f"frame-{number:06d}", pose, *frame)


def drawn(
    renderer: Renderer, poses: PoseTable, with_depth: bool, effects: Effects | None
) -> Iterator[Frame]:
    """Colours, and depth if it is asked for, of every pose: all frames of data sets come from here.

    Args:
        renderer: of the scene.
        poses: what is drawn, as a part of the whole paths.
        with_depth: whether depth is asked for.
        effects: what is added to ideal frames, and through which camera; None draws them ideal.
    """
    if effects is None:
        for pose in poses.world_from_cam:
            yield renderer.render_rgbd(pose) if with_depth else (renderer.render(pose), None)
        return
    whole = poses.whole or poses
    begin = int(np.searchsorted(whole.frame, poses.frame[0]))
    yield from varied_frames(renderer, *effects, whole, begin, begin + len(poses), with_depth)


def effects_of(camera: CameraConfig, render: RenderConfig | None) -> Effects | None:
    """What :func:`drawn` takes."""
    return (camera, render.effects) if render and render.effects else None


@contextmanager
def _new_sequence(out: Path) -> Iterator[Path]:
    """A directory to fill with frames, which becomes ``out``, or is packed into it."""
    if not is_archive(out):
        with atomic_directory(out) as directory:
            yield directory
        return
    refuse_existing(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{out.stem}-", dir=out.parent) as directory_name:
        yield Path(directory_name)
        write_archive(Path(directory_name), out)


def resolved(render: RenderConfig) -> RenderConfig:
    """With ``auto`` replaced by the backend it stands for on this machine.

    Raises:
        InputError: no backend works here.
    """
    if render.backend != "auto":
        return render
    return render.model_copy(update={"backend": fastest_working()})


def render_packed(
    mesh_path: Path,
    camera: CameraConfig,
    poses: PoseTable,
    input_px: int,
    out: Path,
    render: RenderConfig | None = None,
    view: View = "square",
) -> None:
    """Render every pose of the table into one array, as :func:`pack_frames` makes it of files.

    ``<out>.json``, in place of ``.npy``, says how many frames it holds and which backend drew them.

    Raises:
        InputError: the mesh cannot be read, or the file cannot be written.
    """
    chosen = resolved(render or RenderConfig())
    with (
        writing_to(out, lambda: REMEDY),
        open_scene(mesh_path, camera, chosen) as renderer,
        new_packed(out, len(poses), input_px) as packed,
        Progress(len(poses), out.stem) as progress,
    ):
        watch = Stopwatch()
        frames = drawn(renderer, poses, False, effects_of(camera, chosen))
        for index, (rgb, _) in enumerate(frames):
            packed[index] = fit_frame(Image.fromarray(rgb), input_px, view)
            progress.update()
        write_json(out.with_suffix(".json"), {"frames": len(poses), "backend": chosen.backend})
    progress.part_done(out.stem, len(poses), watch.seconds)


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
