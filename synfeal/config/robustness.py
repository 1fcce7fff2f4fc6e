"""Typed configuration of the robustness table: what trained localizers are tested on besides."""

from __future__ import annotations

from pydantic import Field

from synfeal.config.collection import SizeName, Slug, Strict
from synfeal.config.rendering import EffectsConfig


class RobustnessConfig(Strict):
    """Test paths rendered anew with effects, for localizers trained without and with them."""

    scene: Slug = Field("large_room", description="scene of the data set")
    size: SizeName = Field("6k", description="its size")
    effects: dict[Slug, EffectsConfig] = Field(
        default_factory=dict,
        description="what the test frames are rendered with, by the name of the table's row; empty:"
        " no table",
    )
    mixed: EffectsConfig = Field(
        default_factory=EffectsConfig,
        description="what the frames of a second training set are rendered with",
    )
