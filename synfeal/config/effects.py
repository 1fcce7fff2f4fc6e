"""Settings of the effects of camera and world on ideal frames, and of robustness tests."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from synfeal.config.collection import CollectionConfig
from synfeal.config.types import Count, NonNegative, Positive, Seed, SizeName, Slug, Strict, part

Kelvin = Annotated[float, Field(ge=2000, le=25000)]
MOST_PATH_OBJECTS = 100
Stops = Annotated[float, Field(ge=-10, le=10)]


class LightConfig(Strict):
    """The light of a path: drawn once for each, the same for all of its frames."""

    states: tuple[Literal["all", "lamps", "daylight", "dusk", "night"], ...] = Field(
        (), description="stand-ins: which lights are on; one drawn per path"
    )
    ev: tuple[Stops, Stops] = Field((0.0, 0.0), description="brightness, stops; drawn per path")
    temperature_k: tuple[Kelvin, Kelvin] = Field(
        (6500.0, 6500.0),
        description="colour temperature, drawn between these, uniform in mired; 6500 leaves the"
        " mesh as it is",
    )
    field_ev: float = Field(
        0.0, ge=0, le=5, description="smooth change across the scene: standard deviation, stops"
    )
    field_m: Positive = Field(3.0, description="its shortest wavelength")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("ev", "temperature_k"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: the first number must not be above the second")
        return self


class MotionBlurConfig(Strict):
    """The path of the camera during one exposure, centred on the pose of the frame."""

    exposure_s: Positive = Field(0.02, description="exposure time")
    subframes: int = Field(8, ge=2, le=64, description="frames whose light is averaged")


class ExposureConfig(Strict):
    """Amount of light that makes a pixel white."""

    ev: Stops = Field(0.0, description="compensation, stops: 1 doubles the light")
    time_constant_s: Positive | None = Field(None, description="lag of auto-exposure; null: none")
    target: float = Field(0.18, gt=0, lt=1, description="auto-exposure: mean light, white is 1")
    most_ev: float = Field(3.0, ge=0, le=10, description="auto-exposure: largest correction, stops")


class NoiseConfig(Strict):
    """Photon-transfer model: variance in electrons is the signal plus that of reading out."""

    full_well_e: float = Field(10_000.0, ge=1, le=1e7, description="electrons of a white pixel")
    read_e: NonNegative = Field(5.0, description="read noise, electrons RMS")


class PathObjectsConfig(Strict):
    """Objects that stand about, differently along every path, none in the way of the camera."""

    count: int = Field(8, ge=1, le=MOST_PATH_OBJECTS, description="how many, where they fit")
    files: tuple[Path, ...] = Field((), description="meshes in metres, used in turn; none: cartons")


class EffectsConfig(Strict):
    """Effects on ideal frames, applied in the order of the keys; absent ones are left out."""

    unless_none = ("clutter",)

    seed: Seed = Field(0, description="of noise, lights and the choice of paths")
    share: float = Field(1.0, gt=0, le=1, description="share of the paths that each effect acts on")
    speed_m_s: Positive = Field(0.5, description="camera's speed: gives the time between frames")
    light: LightConfig | None = Field(None, description="light by path")
    motion_blur: MotionBlurConfig | None = Field(None, description="movement during exposure")
    exposure: ExposureConfig | None = Field(None, description="fixed or automatic")
    noise: NoiseConfig | None = Field(None, description="shot and read noise")
    white_balance_k: Kelvin | None = Field(None, description="taken for white, in light of 6500 K")
    jpeg_quality: Annotated[int, Field(ge=1, le=95)] | None = Field(None, description="of libjpeg")
    clutter: PathObjectsConfig | None = Field(None, description="other objects along each path")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.clutter and self.light and self.light.states:
            raise ValueError(
                "clutter: it is not known where the light of objects comes from; leave"
                " light.states out"
            )
        return self


CLEAN, MIXED = "clean", "mixed"


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
    """Limit the exposure to the time between frames."""
    blur = effects.motion_blur
    if blur is None or collection.mode == "repeat":
        return effects
    exposure_s = min(blur.exposure_s, collection.frame_spacing_m / effects.speed_m_s)
    shorter = blur.model_copy(update={"exposure_s": exposure_s})
    return effects.model_copy(update={"motion_blur": shorter})


def refuse_long_exposure(effects: EffectsConfig, collection: CollectionConfig, key: str) -> None:
    """Refuse an exposure longer than the time between two frames.

    Repeated poses (mode ``repeat``) always pass: ``frame_spacing_m`` is not theirs.

    Args:
        effects: Effects with the exposure of motion blur and the speed of the camera.
        collection: Mode, and the distance between frames.
        key: Key of the configuration that holds the effects, for messages.

    Raises:
        ValueError: The exposure is too long, or motion blur is asked of independent frames.
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
