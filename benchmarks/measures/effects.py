"""Cost of effects per frame, as multiples of an ideal one."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from reproduction.speed.collection import seconds_of_effects
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import CLEAN, EffectsConfig
from synfeal.config.types import Strict
from synfeal.dataset.pose_table import read_frames


class Case(Strict):
    """Scene, camera and effects to draw."""

    mesh: Path = Field(description="mesh.glb of a scene")
    plan: Path = Field(description="pose table")
    frames: int = Field(40, ge=2, description="frames to draw, from the first")
    camera: CameraConfig = Field(description="camera of the frames")
    effects: dict[str, EffectsConfig] = Field(description="what is added, by name")


def run(case: Case, seed: int) -> dict[str, float]:
    """Measure the processor seconds of an ideal frame, and each effect's as a multiple of them.

    Raises:
        InputError: mesh or plan cannot be used.
    """
    poses = read_frames(case.plan, 0, case.frames)
    taken_s = seconds_of_effects(case.mesh, poses, case.camera, RenderConfig(), case.effects)
    ideal_s = taken_s.pop(CLEAN)
    return {"ideal_s": ideal_s, **{name: s / ideal_s for name, s in taken_s.items()}}
