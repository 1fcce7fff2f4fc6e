"""Typed configuration of what localizers are compared with."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from synfeal.config.collection import Count, Positive, Slug, Strict


class ExternalConfig(Strict):
    """A localizer of somebody else's: a command that is run, or files of poses that are read.

    `{scene}`, `{size}` and `{labels}` are filled in, so that there is one for every data set.
    """

    title: str = Field(description="as tables and figures call it")
    poses: str = Field(
        "",
        description="path of its answers, a table of poses (docs/references.md), e.g."
        " `mine/{scene}-{size}-{labels}.csv`",
    )
    command: str = Field(
        "",
        description="what writes them instead, with `{train_frames}`, `{train_labels}`,"
        " `{test_frames}`, `{n_test}` and `{out}` filled in too",
    )
    labels: list[str] = Field(
        default_factory=list, description="label sets it answers for; empty: all of the design"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if bool(self.poses) == bool(self.command):
            raise ValueError("give either `poses` or `command`, not both or neither")
        return self


class ReferencesConfig(Strict):
    """Methods that localizers are read against: retrieval, structure-based poses."""

    max_features: Count = Field(1000, description="structure: SIFT features per image")
    contrast: Positive = Field(
        0.013, description="structure: least contrast of a feature, on OpenCV's scale (its 0.04)"
    )
    retrieved: Count = Field(
        20, description="structure: training images that a test image is matched with"
    )
    coordinate_samples: Count = Field(
        2000, description="scene coordinates: images shown to the network in all"
    )
    external: dict[Slug, ExternalConfig] = Field(
        default_factory=dict, description="localizers of somebody else's, by name"
    )
