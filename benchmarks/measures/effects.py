"""What effects cost a frame, beside ideal frames drawn in turn with theirs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from pydantic import Field

from synfeal.config.models import CameraConfig, EffectsConfig, RenderConfig, Strict
from synfeal.dataset.png import encode_png
from synfeal.dataset.pose_table import PoseTable, read_frames
from synfeal.dataset.render_sequence import Effects, drawn
from synfeal.mesh.load import load_mesh
from synfeal.render import open_renderer
from synfeal.render.base import Renderer


class Case(Strict):
    """What is drawn."""

    mesh: Path = Field(description="mesh.glb of a scene")
    plan: Path = Field(description="pose table")
    frames: int = Field(40, ge=2, description="frames to draw, from the first")
    camera: CameraConfig = Field(description="camera of the frames")
    effects: dict[str, EffectsConfig] = Field(description="what is added, by name")


def run(case: Case, seed: int) -> dict[str, float]:
    """Seconds of the processor an ideal frame, and how many of them one with each effect takes.

    Raises:
        InputError: mesh or plan cannot be used.
    """
    poses = read_frames(case.plan, 0, case.frames)
    with open_renderer(load_mesh(case.mesh), case.camera, RenderConfig()) as renderer:
        columns = {"ideal_s": _timed(renderer, poses, None)}
        for name, effects in case.effects.items():
            columns[name] = _timed(renderer, poses, (case.camera, effects))
        rows = list(zip(*columns.values(), strict=True))[1:]  # the first loads what all use
    ideal_s, *others_s = (sum(column) / len(rows) for column in zip(*rows, strict=True))
    quotients = (other_s / ideal_s for other_s in others_s)
    return {"ideal_s": ideal_s, **dict(zip(case.effects, quotients, strict=True))}


def _timed(renderer: Renderer, poses: PoseTable, effects: Effects | None) -> Iterator[float]:
    """Seconds of the processor that each frame takes, drawn and compressed."""
    frames = drawn(renderer, poses, False, effects)
    for _ in range(len(poses)):
        began = time.process_time()
        encode_png(next(frames)[0])
        yield time.process_time() - began
