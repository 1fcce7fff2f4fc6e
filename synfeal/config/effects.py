"""Settings of the effects of camera and world on ideal frames."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from synfeal.config.collection import INDEPENDENT, CollectionConfig
from synfeal.config.types import NonNegative, Positive, Seed, Strict

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


CLEAN = "clean"  # what tables call frames without effects


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
    if collection.mode in INDEPENDENT:
        raise ValueError(f"{key}.motion_blur: independent frames have no motion; leave it out")
    frame_s = collection.frame_spacing_m / effects.speed_m_s
    if blur.exposure_s > frame_s:
        raise ValueError(
            f"{key}.motion_blur.exposure_s: {blur.exposure_s:g} s is longer than the"
            f" {frame_s:.3g} s between frames (collection.frame_spacing_m by speed_m_s)"
        )
