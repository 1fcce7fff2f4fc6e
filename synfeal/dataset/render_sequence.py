"""Rendering for one job of the workflow: a sequence of files, or packed frames."""

from __future__ import annotations

import logging
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import repeat
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import EffectsConfig
from synfeal.dataset.depth import (
    MILLIMETRES,
    encode_depth,
    farthest_m,
    share_beyond_storage,
)
from synfeal.dataset.frame_files import encode_png, is_archive, write_archive
from synfeal.dataset.layer_files import mask_pixels, normal_pixels
from synfeal.dataset.packed import NetworkView, fit_frame, new_packed
from synfeal.dataset.pose_table import PoseTable, read_frames
from synfeal.dataset.sequence_listing import (
    COLOR,
    DEPTH,
    MASK,
    NORMAL,
    POSE,
    RIGHT_COLOR,
    RIGHT_DEPTH,
)
from synfeal.dataset.sevenscenes import pose_text
from synfeal.effects.apply import Frame, varied_frames
from synfeal.effects.scene import SceneRenderer, open_scene
from synfeal.geometry.poses import moved_right
from synfeal.records.files import (
    atomic_directory,
    refuse_existing,
    unfinished_prefix,
    write_json,
    writing_to,
)
from synfeal.records.progress import Progress
from synfeal.render.choose import fastest_working, graphics
from synfeal.render.surface import Layers

log = logging.getLogger("synfeal")
Effects = tuple[CameraConfig, EffectsConfig]
REMEDY = "nothing was kept; fix that and render again"


def render_sequence(
    mesh: Path,
    camera: CameraConfig,
    plan: Path,
    start: int,
    stop: int,
    with_depth: bool,
    render: RenderConfig,
    out_frames: Path,
    detail: Path | None = None,
    with_normals: bool = False,
    with_masks: bool = False,
) -> None:
    """Render poses of a table into a new sequence, which appears when it is complete.

    Frames are numbered from 0 inside the sequence.

    Args:
        mesh: Mesh in the world frame, as :func:`synfeal.mesh.save.save_glb` writes it.
        camera: Camera of the frames.
        plan: Pose table.
        start: Row of the first frame.
        stop: One past the row of the last frame.
        with_depth: Write depth, too.
        render: Backend and effects.
        out_frames: Directory to write, or an archive if its name ends in ``.zip``.
        detail: Mesh that colours are drawn from; None for ``mesh`` itself.
        with_normals: Write normals, too.
        with_masks: Write masks of instances, too.
    """
    began, poses = time.perf_counter(), read_frames(plan, start, stop)
    with (
        writing_to(out_frames, lambda: REMEDY),
        open_scene(mesh, camera, render, detail) as renderer,
        Progress(len(poses), out_frames.name) as progress,
    ):
        write_sequence(
            renderer,
            poses,
            out_frames,
            Layers(depth=with_depth, normals=with_normals, masks=with_masks),
            progress.update,
            effects_of(camera, render),
            camera.stereo_baseline_m,
            camera.depth_units_per_m or MILLIMETRES,
        )
    progress.part_done(out_frames.name, len(poses), time.perf_counter() - began)


THREADS = 4
MOST_WAITING = 2 * THREADS  # frames in memory, whatever the length of the sequence


def write_sequence(
    renderer: SceneRenderer,
    poses: PoseTable,
    out: Path,
    layers: Layers,
    on_frame: Callable[[], object] = lambda: None,
    effects: Effects | None = None,
    stereo_baseline_m: float | None = None,
    depth_units_per_m: float = MILLIMETRES,
) -> None:
    """Render every pose of the table; files are written while the next frames are rendered.

    The directory they are written to gets its name when they are whole, so they need no temporary
    ones.

    Args:
        renderer: Draws the frames.
        poses: Their poses.
        out: Directory or archive to write.
        layers: What is written beside colours; of the right camera of pairs, depth alone.
        on_frame: Called for each frame that is whole.
        effects: What is added to ideal frames, if anything.
        stereo_baseline_m: Distance to a second camera on the right that is drawn, too; None draws
            none.
        depth_units_per_m: Stored value of a depth of one metre.
    """
    with _new_sequence(out) as directory, ThreadPoolExecutor(THREADS) as threads:
        waiting: deque[Future[None]] = deque()
        beyond = 0.0  # sum of shares
        frames = drawn(renderer, poses, layers, effects)
        to_right: Iterator[Frame | None] = repeat(None, len(poses))
        if stereo_baseline_m is not None:
            moved = poses.with_poses(moved_right(poses.world_from_cam, stereo_baseline_m))
            to_right = drawn(renderer, moved, Layers(depth=layers.depth), None)
        try:
            every = zip(poses.world_from_cam, frames, to_right, strict=True)
            for number, (pose, frame, right) in enumerate(every):
                stem = directory / f"frame-{number:06d}"
                if frame.depth_m is not None:
                    beyond += share_beyond_storage(frame.depth_m, depth_units_per_m)
                writing = threads.submit(_write_frame, stem, pose, frame, right, depth_units_per_m)
                waiting.append(writing)
                while len(waiting) > (MOST_WAITING if number + 1 < len(poses) else 0):
                    waiting.popleft().result()
                    on_frame()
        finally:
            threads.shutdown(cancel_futures=True)
    if beyond:
        _warn_of_far_depth(out.name, beyond / len(poses), depth_units_per_m)


def _warn_of_far_depth(name: str, share: float, units_per_m: float) -> None:
    log.warning(
        "%s: %.2g %% of the pixels show a surface farther than %.1f m, the most that depth of 16"
        " bits can hold in units of 1/%g m; they have colour, and read as nothing in its depth"
        " images. Collect with coarser units (`depth_scale=%g`), or keep the camera nearer (`box`)",
        name,
        100 * share,
        farthest_m(units_per_m),
        units_per_m,
        units_per_m / 10,
    )


def _write_frame(
    stem: Path,
    world_from_cam: NDArray[np.float64],
    frame: Frame,
    right: Frame | None,
    depth_units_per_m: float,
) -> None:
    """Write ``<stem>.color.png``, ``.pose.txt``, and the layers of the frame; of a pair both."""
    stem.with_suffix(f".{POSE}").write_bytes(pose_text(world_from_cam).encode())
    _write_images(stem, frame, COLOR, DEPTH, depth_units_per_m)
    if frame.normals_cam is not None:
        pixels = normal_pixels(frame.normals_cam)
        stem.with_suffix(f".{NORMAL}").write_bytes(encode_png(pixels))
    if frame.ids is not None:
        stem.with_suffix(f".{MASK}").write_bytes(encode_png(mask_pixels(frame.ids)))
    if right is not None:
        _write_images(stem, right, RIGHT_COLOR, RIGHT_DEPTH, depth_units_per_m)


def _write_images(
    stem: Path, frame: Frame, color_kind: str, depth_kind: str, depth_units_per_m: float
) -> None:
    if frame.depth_m is not None:
        content = encode_depth(frame.depth_m, depth_units_per_m)
        stem.with_suffix(f".{depth_kind}").write_bytes(content)
    stem.with_suffix(f".{color_kind}").write_bytes(encode_png(frame.rgb))


def drawn(
    renderer: SceneRenderer, poses: PoseTable, layers: Layers, effects: Effects | None
) -> Iterator[Frame]:
    """Draw a frame of every pose: all frames of data sets come from here.

    Args:
        renderer: Renderer of the scene.
        poses: Poses, whole paths or parts of them.
        layers: What is wanted beside colours.
        effects: What is added to ideal frames, through their camera; None draws them ideal.
    """
    if effects is None:
        for pose in poses.world_from_cam:
            if layers.depth:
                frame = Frame(*renderer.render_rgbd(pose))
            else:
                frame = Frame(renderer.render(pose))
            yield frame.with_surface(layers, renderer, pose)
        return
    whole = poses.whole or poses
    begin = int(np.searchsorted(whole.frame, poses.frame[0]))
    yield from varied_frames(renderer, *effects, whole, begin, begin + len(poses), layers)


def effects_of(camera: CameraConfig, render: RenderConfig | None) -> Effects | None:
    """Return the effects that :func:`drawn` takes."""
    return (camera, render.effects) if render and render.effects else None


@contextmanager
def _new_sequence(out: Path) -> Iterator[Path]:
    """Yield a directory to fill with frames, which becomes ``out``, or is packed into it."""
    if not is_archive(out):
        with atomic_directory(out) as directory:
            yield directory
        return
    refuse_existing(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    prefix = unfinished_prefix(out.stem)
    with tempfile.TemporaryDirectory(prefix=prefix, dir=out.parent) as directory_name:
        yield Path(directory_name)
        write_archive(Path(directory_name), out)


def resolved(render: RenderConfig) -> RenderConfig:
    """Replace ``auto`` by the backend it stands for on this machine."""
    if render.backend != "auto":
        return render
    return render.model_copy(update={"backend": fastest_working()})


def render_packed(
    mesh: Path,
    camera: CameraConfig,
    plan: Path,
    start: int,
    stop: int,
    input_px: int,
    view: NetworkView,
    render: RenderConfig,
    out_frames: Path,
    detail: Path | None = None,
) -> None:
    """Render rows of a plan into one array, as :func:`pack_frames` packs frames.

    Args:
        mesh: Mesh in the world frame.
        camera: Camera of the frames.
        plan: Pose table.
        start: Row of the first frame.
        stop: One past the row of the last frame.
        input_px: Side of the packed frames, pixels.
        view: Whether all of a frame or its central square is packed.
        render: Backend and effects.
        out_frames: File ``.npy`` to write; ``.json`` beside it says how many frames it holds and
            what drew them.
        detail: Mesh that colours are drawn from; None for ``mesh`` itself, see
            :func:`synfeal.effects.scene.open_scene`.
    """
    chosen, poses = resolved(render), read_frames(plan, start, stop)
    with (
        writing_to(out_frames, lambda: REMEDY),
        open_scene(mesh, camera, chosen, detail) as renderer,
        new_packed(out_frames, len(poses), input_px) as packed,
        Progress(len(poses), out_frames.stem) as progress,
    ):
        began = time.perf_counter()
        frames = drawn(renderer, poses, Layers(), effects_of(camera, chosen))
        for index, frame in enumerate(frames):
            packed[index] = fit_frame(Image.fromarray(frame.rgb), input_px, view)
            progress.update()
        record = {"frames": len(poses), **graphics(chosen.backend)}
        write_json(out_frames.with_suffix(".json"), record)
    progress.part_done(out_frames.stem, len(poses), time.perf_counter() - began)
