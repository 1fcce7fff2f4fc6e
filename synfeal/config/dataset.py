"""The part of a profile that data sets are made of: all that ``collect`` and `datasets` share."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from synfeal.config.camera import CameraConfig
from synfeal.config.collection import CollectionConfig, Count, SceneConfig, Slug, Strict
from synfeal.config.rendering import EffectsConfig, RenderConfig


class DatasetConfig(Strict):
    """Scenes, how many frames of them, and how they are planned and drawn."""

    profile: Slug = Field(description="name, and directory under `results`")
    seed: int = Field(0, ge=0, lt=2**63, description="root of all seeds")
    scale: float = Field(gt=0, le=1, description="share of the paper's frames")
    results: Path = Field(Path("results"), description="where runs are written")
    shard_frames: Count = Field(500, description="frames of a render job, and of a sequence")
    archive_sequences: bool = Field(False, description="write a sequence as one `seq-XX.zip`")
    scenes: dict[Slug, SceneConfig] = Field(description="scenes by name")
    collection: CollectionConfig = Field(
        default_factory=CollectionConfig, description="camera movement"
    )
    network_camera: CameraConfig = Field(
        default_factory=CameraConfig, description="camera of the localizers' frames"
    )
    network_depth: bool = Field(False, description="write its depth images too")
    render: RenderConfig = Field(default_factory=RenderConfig, description="how frames are drawn")

    @model_validator(mode="after")
    def _check_effects(self) -> Self:
        if self.render.effects is not None:
            refuse_long_exposure(self.render.effects, self.collection, "render.effects")
            light = self.render.effects.light
            if light and light.states and any(s.source == "mesh" for s in self.scenes.values()):
                raise ValueError(
                    "render.effects.light.states: nothing is known of the lamps of a mesh of your"
                    " own; use ev, temperature_k and field_ev"
                )
            if light and light.states and any(s.clutter for s in self.scenes.values()):
                raise ValueError(
                    "render.effects.light.states: nothing is known of the light on objects; leave"
                    " out the clutter of the scenes"
                )
        return self

    @property
    def root(self) -> Path:
        """Directory of this profile's results."""
        return self.results / self.profile

    def n_frames(self, scene: str, size: str, split: str) -> int:
        """Frames of a split at this profile's scale: at least 2, where there are as many."""
        full: int = getattr(self.scenes[scene].sizes[size], split)
        return max(min(2, full), round(full * self.scale))


def refuse_long_exposure(effects: EffectsConfig, collection: CollectionConfig, key: str) -> None:
    """Refuse to expose for longer than there is between two frames.

    Raises:
        ValueError: naming what stands under ``key``.
    """
    blur = effects.motion_blur
    if blur is None or collection.mode == "repeat":
        return
    if collection.mode == "random":
        raise ValueError(f"{key}.motion_blur: independent frames have no motion; leave it out")
    frame_s = collection.frame_spacing_m / effects.speed_m_s
    if blur.exposure_s > frame_s:
        raise ValueError(
            f"{key}.motion_blur.exposure_s: {blur.exposure_s:g} s is longer than the"
            f" {frame_s:.3g} s between frames (collection.frame_spacing_m by speed_m_s)"
        )
