"""Typed configuration of how frames are drawn, and what a camera and its world add to them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from synfeal.config.collection import Channel, Count, NonNegative, Positive, Strict

Kelvin = Annotated[float, Field(ge=2000, le=25000)]
Stops = Annotated[float, Field(ge=-10, le=10)]


class LightConfig(Strict):
    """The light of a path: drawn once for each, the same for all of its frames."""

    states: tuple[Literal["all", "lamps", "daylight", "dusk", "night"], ...] = Field(
        (), description="stand-ins: which lights are on; one drawn per path"
    )
    ev: tuple[Stops, Stops] = Field(
        (0.0, 0.0), description="brightness, stops, drawn per path between these"
    )
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
    """How much light makes a pixel white."""

    ev: Stops = Field(0.0, description="compensation, stops: 1 doubles the light")
    time_constant_s: Positive | None = Field(None, description="lag of auto-exposure; null: none")
    target: float = Field(
        0.18, gt=0, lt=1, description="auto-exposure: mean light aimed at, white is 1"
    )
    most_ev: float = Field(3.0, ge=0, le=10, description="auto-exposure: largest correction, stops")


class NoiseConfig(Strict):
    """Photon-transfer model: variance in electrons is the signal plus that of reading out."""

    full_well_e: float = Field(10_000.0, ge=1, le=1e7, description="electrons of a white pixel")
    read_e: NonNegative = Field(5.0, description="read noise, electrons RMS")


class PathObjectsConfig(Strict):
    """Objects that stand about, differently along every path, none in the way of the camera."""

    count: int = Field(8, ge=1, le=100, description="how many, where they fit")
    files: tuple[Path, ...] = Field(
        (), description="meshes in metres, taken in turn; none: cartons"
    )


class EffectsConfig(Strict):
    """What is added to ideal frames, in the order of the keys; what is absent is not added."""

    unless_none = ("clutter",)

    seed: int = Field(0, ge=0, lt=2**63, description="of noise, lights and the choice of paths")
    share: float = Field(1.0, gt=0, le=1, description="share of the paths that each effect acts on")
    speed_m_s: Positive = Field(
        0.5, description="speed of the camera: gives the time between frames"
    )
    light: LightConfig | None = Field(None, description="light by path")
    motion_blur: MotionBlurConfig | None = Field(None, description="movement during exposure")
    exposure: ExposureConfig | None = Field(None, description="fixed or automatic")
    noise: NoiseConfig | None = Field(None, description="shot and read noise")
    white_balance_k: Kelvin | None = Field(
        None, description="colour temperature taken for white, in light of 6500"
    )
    jpeg_quality: Annotated[int, Field(ge=1, le=95)] | None = Field(
        None, description="libjpeg's scale"
    )
    clutter: PathObjectsConfig | None = Field(
        None, description="objects that stand about, other ones along each path"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.clutter and self.light and self.light.states:
            raise ValueError(
                "clutter: it is not known where the light of objects comes from; leave"
                " light.states out"
            )
        return self


class RenderConfig(Strict):
    """How images are drawn."""

    unless_none = ("effects",)

    backend: Literal["auto", "opengl", "pyrender", "raycast"] = Field(
        "auto", description="`auto`: the fastest that works here"
    )
    supersampling: int = Field(2, ge=1, le=4, description="samples per pixel along each axis")
    background_rgb: tuple[Channel, Channel, Channel] = Field(
        (0, 0, 0), description="where nothing is hit"
    )
    effects: EffectsConfig | None = Field(
        None, description="what is added to ideal frames (docs/variation.md)"
    )


class RenderSpeedConfig(Strict):
    """How speed and error of rendering are measured, for `speed_vs_error.csv`."""

    poses: Count = Field(6, description="views of each scene; half as many at the larger sizes")
    sizes: int = Field(
        3,
        ge=1,
        le=3,
        description="how many of network_camera, groundtruth_camera and 640 × 480, smallest first",
    )
