"""A profile: everything a run depends on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from baselines.config.labels import EstimationConfig
from baselines.config.learning import (
    MODELS,
    SHIPPED_WIDTH,
    Localizers,
    NetworkConfig,
    PretrainingConfig,
)
from baselines.config.references import ReferencesConfig
from reproduction.config.dataset import DatasetConfig
from reproduction.config.robustness import RobustnessConfig
from reproduction.config.tables import RepeatedTraining, TableName
from synfeal.config.dataset import CameraConfig
from synfeal.config.types import Count, Slug, Strict, part

# An image costs the network of scene coordinates as much as so many cost a localizer: where
# localizers of the published `night` were shown 30,000 images and scene coordinates 2,000, their
# jobs took the same processor time (results/published/night/benchmarks.csv).
IMAGES_PER_COORDINATE_IMAGE = 15
# Keys of earlier versions, and what they are called now.
RENAMED_KEYS = {"groundtruth": "estimation", "groundtruth_camera": "estimation_camera"}


class RenderSpeedConfig(Strict):
    """Measurement of the speed and error of rendering, for `speed_vs_error.csv`."""

    poses: Count = Field(6, description="views of each scene; half as many at the larger sizes")
    sizes: int = Field(
        2,
        ge=1,
        le=2,
        description="how many of network_camera and, with estimated labels, estimation_camera,"
        " smallest first",
    )


class Config(DatasetConfig):
    """A profile: everything a run depends on."""

    experiments: Path | tuple[Path | dict[str, Any], ...] = Field(
        Path("config/experiments.csv"),
        description="the design as a table: its CSV file, or a list of such files and of rows",
    )
    tables: tuple[TableName, ...] | None = Field(
        None, description="tables of the design that are made; null: all that it has rows of"
    )
    datasets: tuple[Slug, ...] | None = Field(
        None, description="scenes of the target `datasets`; null: those of the design"
    )
    estimation_camera: CameraConfig = part(CameraConfig, "of frames labels are estimated from")
    render_speed: RenderSpeedConfig = part(RenderSpeedConfig, "what rendering is measured on")
    estimation: EstimationConfig = part(EstimationConfig, "labels (docs/estimation.md)")
    references: ReferencesConfig = part(ReferencesConfig, "other methods (docs/references.md)")
    robustness: RobustnessConfig = part(RobustnessConfig, "tests with effects (docs/variation.md)")
    network: NetworkConfig = part(NetworkConfig, "shape of all localizers")
    training: RepeatedTraining = Field(description="docs/localizers.md")
    pretraining: PretrainingConfig = part(PretrainingConfig, "what runs start from (docs/start.md)")
    localizers: Localizers = Field(description="hyper-parameters of each")

    @model_validator(mode="before")
    @classmethod
    def _has_present_keys(cls, given: Any) -> Any:
        """Refuse keys of earlier versions, naming those that took their place."""
        for old, new in RENAMED_KEYS.items():
            if isinstance(given, Mapping) and old in given:
                raise ValueError(f"{old}: is called {new} now; rename the key")
        return given

    @model_validator(mode="after")
    def _check(self) -> Self:
        missing = [name for name in MODELS if name not in self.localizers]
        if missing:
            raise ValueError(f"localizers: {', '.join(missing)} missing; all five are compared")
        if self.pretraining.source == "imagenet" and self.network.width != 1.0:
            raise ValueError("network.width: must be 1 when pretraining.source is imagenet")
        if self.pretraining.source == "shipped" and self.network.width != SHIPPED_WIDTH:
            raise ValueError(
                f"network.width: must be {SHIPPED_WIDTH} when pretraining.source is shipped"
            )
        unknown = sorted(set(self.datasets or ()) - set(self.scenes))
        if unknown:
            raise ValueError(f"datasets: '{unknown[0]}' is not one of {sorted(self.scenes)}")
        if self.pretraining.source == "rooms" and not self.rooms:
            raise ValueError("pretraining.source: rooms needs scenes with `builder: random_room`")
        estimated = self.estimation_camera
        if estimated.projection is not None or estimated.stereo_baseline_m is not None:
            raise ValueError(
                "estimation_camera: labels are estimated from single perspective images; leave out"
                " projection and stereo_baseline_m"
            )
        camera = self.network_camera
        least = self.network.input_px + (self.network.view == "square")
        if min(camera.width, camera.height) < least:
            raise ValueError(
                f"network_camera: both sides must be at least {least} pixels for"
                f" network.input_px {self.network.input_px} and this network.view"
            )
        return self

    @property
    def rooms(self) -> list[str]:
        """Scenes that backbones are pretrained on: no table has them."""
        return [name for name, scene in self.scenes.items() if scene.builder == "random_room"]

    def coordinate_samples(self, size: str) -> int:
        """Images that scene coordinates of a size are learned from."""
        given = self.references.coordinate_samples
        return given or max(1, self.training.samples_seen[size] // IMAGES_PER_COORDINATE_IMAGE)

    def n_largest(self, scene: str, split: str) -> int:
        """Count frames planned and rendered for a split: those of the scene's largest size."""
        if scene in self.rooms:
            return self.pretraining.frames if split == "train" else 2
        return max(self.n_frames(scene, size, split) for size in self.scenes[scene].sizes)
