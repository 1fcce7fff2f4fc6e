"""Typed configuration of the reference methods."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from baselines.registry.kinds import Group
from synfeal.config.types import Count, Positive, Slug, Strict, part


class ExternalConfig(Strict):
    """A localizer of somebody else's: a command that is run, or files of poses that are read.

    `{scene}`, `{size}` and `{labels}` are filled in, so that there is one for every data set.
    """

    title: str = Field(description="as tables and figures call it")
    poses: str = Field("", description="its answers, e.g. `mine/{scene}-{size}-{labels}.csv`")
    command: str = Field("", description="or what writes them")
    labels: list[str] = Field([], description="label sets it answers for; none: all")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if bool(self.poses) == bool(self.command):
            raise ValueError("give either `poses` or `command`, not both or neither")
        return self


class ReferencesConfig(Strict):
    """Methods that localizers are read against: retrieval, structure-based poses."""

    groups: tuple[Group, ...] = Field(
        ("images", "structure", "adjusted", "coordinates"),
        description="which are asked: retrieval and oracle; structure-based poses; the same of"
        " bundle-adjusted maps; scene coordinates",
    )
    structure_sets: Literal["all", "few"] = Field(
        "all",
        description="structure: for all label sets, or for the true poses, those of SfM and the"
        " largest noise of each block of Table 3",
    )
    structure_sizes: Literal["labelled", "all"] = Field(
        "labelled",
        description="structure, adjusted, coordinates: on sizes whose labels are estimated, which"
        " have frames with depth, or on all sizes, of which such frames are then rendered",
    )
    max_features: Count = Field(1000, description="structure: SIFT features per image")
    contrast: Positive = Field(0.013, description="structure: least contrast (OpenCV: 0.04)")
    retrieved: Count = Field(20, description="structure: training images matched with a test image")
    coordinate_samples: Count | None = Field(
        None,
        description="scene coordinates: images shown in all; null: a fifteenth of"
        " `training.samples_seen` of the size, for as much processor time as a localizer",
    )
    external: dict[Slug, ExternalConfig] = part(dict, "localizers of somebody else's")
