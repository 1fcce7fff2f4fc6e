"""Settings of the tests of robustness."""

from __future__ import annotations

from pydantic import Field, field_validator

from synfeal.config.collection import INDEPENDENT, CollectionConfig
from synfeal.config.effects import CLEAN, EffectsConfig
from synfeal.config.types import Count, SizeName, Slug, Strict, part

MIXED = "mixed"  # what tables call the second training set


class RobustnessConfig(Strict):
    """Test paths rendered anew with effects, for localizers trained without and with them.

    Exposures end where the next frame begins: one setting serves profiles of any frame spacing.
    """

    made: bool = Field(True, description="make the table, where there are effects")
    scene: Slug = Field("large_room", description="of the data set")
    size: SizeName = Field("6k", description="of the data set")
    effects: dict[Slug, EffectsConfig] = part(
        dict, "rows of the table: effects on the test frames; null: not this row"
    )
    mixed: EffectsConfig = part(EffectsConfig, "effects on the second training set")
    structure_frames: Count = Field(
        250, description="test frames for structure-based poses, spread evenly"
    )

    @field_validator("effects", mode="before")
    @classmethod
    def _leave_out(cls, effects: object) -> object:
        """Drop rows that a profile sets to null; profiles are merged over others key by key."""
        if not isinstance(effects, dict):
            return effects
        return {name: row for name, row in effects.items() if row is not None}

    @field_validator("effects")
    @classmethod
    def _check_names(cls, effects: dict[str, EffectsConfig]) -> dict[str, EffectsConfig]:
        taken = sorted({"train", CLEAN, MIXED} & set(effects))
        if taken:
            raise ValueError(f"'{taken[0]}' is a name of the table's own; choose another")
        return effects

    def rendered(self, collection: CollectionConfig, own_mesh: bool) -> dict[str, EffectsConfig]:
        """Return the effects that can be rendered, by name, and ``mixed``.

        Nothing is known of the lamps of a mesh of one's own, and independent frames do not move.
        """
        still = collection.mode in INDEPENDENT
        possible = {
            name: effects
            for name, effects in self.effects.items()
            if not (own_mesh and effects.light and effects.light.states)
            and not (still and effects.motion_blur)
        }
        mixed = self.mixed.model_copy(update={"motion_blur": None}) if still else self.mixed
        return {name: _shortened(e, collection) for name, e in {**possible, MIXED: mixed}.items()}


def _shortened(effects: EffectsConfig, collection: CollectionConfig) -> EffectsConfig:
    """Limit the exposure to the time between frames."""
    blur = effects.motion_blur
    if blur is None or collection.mode == "repeat":
        return effects
    exposure_s = min(blur.exposure_s, collection.frame_spacing_m / effects.speed_m_s)
    shorter = blur.model_copy(update={"exposure_s": exposure_s})
    return effects.model_copy(update={"motion_blur": shorter})
