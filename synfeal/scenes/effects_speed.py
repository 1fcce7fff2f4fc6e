"""What effects cost a frame, beside ideal frames drawn in turn with theirs."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from synfeal.config.effects import CLEAN
from synfeal.config.models import CameraConfig, EffectsConfig, RenderConfig
from synfeal.dataset.png import encode_png
from synfeal.dataset.pose_table import PoseTable, read_frames, read_pose_table
from synfeal.dataset.render_sequence import Effects, drawn
from synfeal.effects.apply import Frame
from synfeal.effects.scene import open_scene
from synfeal.frames import COUNT, NUMBER, TEXT, frame_of, write_frame

FRAMES = 40
SCHEMA = {"effects": TEXT, "width": COUNT, "height": COUNT, "cpu_s_per_frame": NUMBER}


def write_effects_speed(
    mesh: Path,
    plan: Path,
    camera: CameraConfig,
    render: RenderConfig,
    effects: Mapping[str, EffectsConfig],
    out_csv: Path,
) -> None:
    """Write a row for ideal frames and one for each of the effects; times differ between runs."""
    poses = read_frames(plan, 0, min(FRAMES, len(read_pose_table(plan))))
    seconds = seconds_of_effects(mesh, poses, camera, render, effects)
    size = {"width": camera.width, "height": camera.height}
    rows = [{"effects": name, **size, "cpu_s_per_frame": s} for name, s in seconds.items()]
    write_frame(out_csv, frame_of(rows, SCHEMA), float_format=None)


def seconds_of_effects(
    mesh: Path,
    poses: PoseTable,
    camera: CameraConfig,
    render: RenderConfig,
    effects: Mapping[str, EffectsConfig],
) -> dict[str, float]:
    """Seconds of the processor that a frame takes, drawn and compressed: ideal, and with effects.

    All are drawn in turn, so that what else the machine does slows them alike; the first frame
    loads what all use, and does not count.
    """
    switched = [e for e in effects.values() if e.light and e.light.states]
    opened = render.model_copy(update={"effects": switched[0] if switched else None})
    with open_scene(mesh, camera, opened) as renderer:
        through: dict[str, Effects | None] = {CLEAN: None}
        through |= {name: (camera, each) for name, each in effects.items()}
        timed = [_timed(drawn(renderer, poses, False, e), len(poses)) for e in through.values()]
        rows = list(zip(*timed, strict=True))[1:]
    return dict(zip(through, np.mean(rows, axis=0).tolist(), strict=True))


def _timed(frames: Iterator[Frame], count: int) -> Iterator[float]:
    """Seconds of the processor that each of the frames takes."""
    for _ in range(count):
        began = time.process_time()
        encode_png(next(frames)[0])
        yield time.process_time() - began
