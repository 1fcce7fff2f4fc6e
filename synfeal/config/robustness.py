"""Typed configuration of the robustness table: what trained localizers are tested on besides."""

from __future__ import annotations

from pydantic import Field, field_validator

from synfeal.config.collection import CollectionConfig, Count, SizeName, Slug, Strict
from synfeal.config.rendering import EffectsConfig

CLEAN, MIXED = "clean", "mixed"


class RobustnessConfig(Strict):
    """Test paths rendered anew with effects, for localizers trained without and with them.

    Exposures end where the next frame begins: one setting serves profiles of any frame spacing.
    """

    scene: Slug = Field("large_room", description="of the data set")
    size: SizeName = Field("6k", description="of the data set")
    effects: dict[Slug, EffectsConfig] = Field(
        default_factory=dict, description="rows of the table: effects on the test frames"
    )
    mixed: EffectsConfig = Field(
        default_factory=EffectsConfig, description="effects on the second training set"
    )
    structure_frames: Count = Field(
        250, description="test frames for structure-based poses, spread evenly"
    )

    @field_validator("effects")
    @classmethod
    def _check_names(cls, effects: dict[str, EffectsConfig]) -> dict[str, EffectsConfig]:
        taken = sorted({"train", CLEAN, MIXED} & set(effects))
        if taken:
            raise ValueError(f"'{taken[0]}' is a name of the table's own; choose another")
        return effects

    def rendered(self, collection: CollectionConfig, own_mesh: bool) -> dict[str, EffectsConfig]:
        """The effects that can be rendered, by name, and ``mixed``.

        Nothing is known of the lamps of a mesh of one's own, and independent frames do not move.
        """
        still = collection.mode == "random"
        possible = {
            name: effects
            for name, effects in self.effects.items()
            if not (own_mesh and effects.light and effects.light.states)
            and not (still and effects.motion_blur)
        }
        mixed = self.mixed.model_copy(update={"motion_blur": None}) if still else self.mixed
        return {name: _shortened(e, collection) for name, e in {**possible, MIXED: mixed}.items()}


def _shortened(effects: EffectsConfig, collection: CollectionConfig) -> EffectsConfig:
    """With no exposure longer than the time between frames."""
    blur = effects.motion_blur
    if blur is None or collection.mode == "repeat":
        return effects
    exposure_s = min(blur.exposure_s, collection.frame_spacing_m / effects.speed_m_s)
    shorter = blur.model_copy(update={"exposure_s": exposure_s})
    return effects.model_copy(update={"motion_blur": shorter})
