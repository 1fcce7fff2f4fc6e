"""Settings of the benchmark's data sets: the simulator's, at the paper's sizes and scale."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from synfeal.config.collection import CollectionConfig, SceneConfig
from synfeal.config.dataset import CameraConfig, RenderConfig, origin_record, refuse_effects
from synfeal.config.types import MOST_FRAMES, Count, Seed, SizeName, Slug, Strict, part


class SizeConfig(Strict):
    """Frames of a data set at full scale, as the paper prints them."""

    train: int = Field(ge=1, le=MOST_FRAMES, description="training frames at scale 1")
    test: int = Field(ge=0, le=MOST_FRAMES, description="test frames at scale 1")


class SizedScene(SceneConfig):
    """One scene: where its mesh comes from, where the camera may go, and how many frames it has."""

    sizes: dict[SizeName, SizeConfig] = part(dict, "data sets by the paper's names")


class DatasetConfig(Strict):
    """Scenes, how many frames of them, and how they are planned and drawn."""

    profile: Slug = Field(description="name, and directory under `results`")
    seed: Seed = Field(0, description="root of all seeds")
    scale: float = Field(gt=0, le=1, description="share of the paper's frames")
    results: Path = Field(Path("results"), description="where runs are written")
    shard_frames: Count = Field(500, description="frames of a render job, and of a sequence")
    archive_sequences: bool = Field(False, description="write a sequence as one `seq-XX.zip`")
    scenes: dict[Slug, SizedScene] = Field(description="scenes by name")
    collection: CollectionConfig = part(CollectionConfig, "camera movement")
    network_camera: CameraConfig = part(CameraConfig, "camera of the localizers' frames")
    network_depth: bool = Field(False, description="write its depth images too")
    network_normals: bool = Field(False, description="write normals of surfaces too")
    network_masks: bool = Field(False, description="write masks of parts and objects too")
    render: RenderConfig = part(RenderConfig, "how frames are drawn")

    @model_validator(mode="after")
    def _check_effects(self) -> Self:
        try:
            refuse_effects(self.render, self.collection, self.network_camera, self.scenes.values())
        except ValueError as error:
            of = "network_camera" if str(error).startswith("stereo") else "render"
            raise ValueError(f"{of}.{error}") from error
        return self

    @property
    def root(self) -> Path:
        """Directory of this profile's results."""
        return self.results / self.profile

    def origin_of(self, scene: str) -> dict[str, Any]:
        """Return the settings that a data set of a scene comes from, less file names.

        Args:
            scene: Name of the scene.
        """
        return origin_record(scene, self.scenes[scene], self.collection, self.render, self.seed)

    def n_frames(self, scene: str, size: str, split: str) -> int:
        """Count the frames of a split at this profile's scale.

        Args:
            scene: Name of the scene.
            size: Name of the size, such as ``6k``.
            split: ``train`` or ``test``.

        Returns:
            The size's frames times ``scale``, rounded, but at least 2 if the size has as many.
        """
        full: int = getattr(self.scenes[scene].sizes[size], split)
        return max(min(2, full), round(full * self.scale))
