"""Rendering what one job of the workflow makes: a sequence of files, or packed frames."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.dataset.archive import is_archive, write_archive
from synfeal.dataset.directories import atomic_directory, refuse_existing, writing_to
from synfeal.dataset.frame_writer import FrameWriter
from synfeal.dataset.packed import View, fit_frame, new_packed
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.progress import Progress, Stopwatch
from synfeal.files import write_json
from synfeal.mesh.load import load_mesh
from synfeal.render import open_renderer
from synfeal.render.base import Renderer
from synfeal.render.choose import fastest_working

REMEDY = "nothing was kept; mend that and render again"


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
        open_renderer(load_mesh(mesh_path), camera, render) as renderer,
        Progress(len(poses), out.name) as progress,
    ):
        write_sequence(renderer, poses, out, with_depth, progress.update)
    progress.part_done(out.name, len(poses), watch.seconds)


def write_sequence(
    renderer: Renderer,
    poses: PoseTable,
    out: Path,
    with_depth: bool,
    on_frame: Callable[[], object] = lambda: None,
) -> None:
    """Render every pose of the table; files are written while the next frames are rendered.

    Raises:
        OSError: a file cannot be written.
    """
    with _new_sequence(out) as directory, FrameWriter(on_frame) as writer:
        for number, world_from_cam in enumerate(poses.world_from_cam):
            stem = directory / f"frame-{number:06d}"
            if with_depth:
                writer.add(stem, world_from_cam, *renderer.render_rgbd(world_from_cam))
            else:
                writer.add(stem, world_from_cam, renderer.render(world_from_cam), None)


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
        open_renderer(load_mesh(mesh_path), camera, chosen) as renderer,
        new_packed(out, len(poses), input_px) as packed,
        Progress(len(poses), out.stem) as progress,
    ):
        watch = Stopwatch()
        for index, world_from_cam in enumerate(poses.world_from_cam):
            packed[index] = fit_frame(
                Image.fromarray(renderer.render(world_from_cam)), input_px, view
            )
            progress.update()
        write_json(out.with_suffix(".json"), {"frames": len(poses), "backend": chosen.backend})
    progress.part_done(out.stem, len(poses), watch.seconds)
