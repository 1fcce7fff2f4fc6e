"""What an effect costs a frame, beside ideal frames drawn in turn with it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from pydantic import Field

from synfeal.config.models import CameraConfig, EffectsConfig, RenderConfig, Strict
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
    effects: EffectsConfig = Field(description="what is added")


def run(case: Case, seed: int) -> dict[str, float]:
    """Seconds of the processor a frame, ideal and with effects, and their quotient.

    Raises:
        InputError: mesh or plan cannot be used.
    """
    poses = read_frames(case.plan, 0, case.frames)
    render = RenderConfig(effects=case.effects)
    with open_renderer(load_mesh(case.mesh), case.camera, render) as renderer:
        ideal = _timed(renderer, poses, None)
        varied = _timed(renderer, poses, (case.camera, case.effects))
        next(ideal), next(varied)  # what the first frame alone costs
        pairs = list(zip(ideal, varied, strict=True))
    ideal_s, effect_s = (sum(column) / len(pairs) for column in zip(*pairs, strict=True))
    return {"ideal_s": ideal_s, "effect_s": effect_s, "ratio": effect_s / ideal_s}


def _timed(renderer: Renderer, poses: PoseTable, effects: Effects | None) -> Iterator[float]:
    """Seconds of the processor that each frame takes."""
    frames, began = drawn(renderer, poses, False, effects), time.process_time()
    for _ in frames:
        yield time.process_time() - began
        began = time.process_time()
