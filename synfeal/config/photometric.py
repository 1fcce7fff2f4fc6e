"""Ranges of light, lens and sensor in which photographs differ from renderings.

A rendering has one light, one exposure and a perfect sensor. A localizer that is to be used on
photographs is shown its training images under others, drawn anew whenever an image is shown. The
parameters are those of :mod:`synfeal.config.effects` where a whole path or a mesh is not needed:
stops (factors of two), electrons, and shares of the light that is white.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from synfeal.config.effects import NoiseConfig, Stops
from synfeal.config.types import Strict

Share = Annotated[float, Field(ge=0, le=1)]


def _not_falling(interval: tuple[float, float]) -> tuple[float, float]:
    if interval[0] > interval[1]:
        raise PydanticCustomError("order", "the first number must not be above the second")
    return interval


StopsRange = Annotated[tuple[Stops, Stops], AfterValidator(_not_falling)]
ShareRange = Annotated[tuple[Share, Share], AfterValidator(_not_falling)]
OffsetRange = Annotated[
    tuple[Annotated[float, Field(ge=-1, le=1)], Annotated[float, Field(ge=-1, le=1)]],
    AfterValidator(_not_falling),
]


class UnseenConfig(Strict):
    """Fill of pixels that a scan has not seen: empty in renderings, anything in photographs.

    Empty pixels are told by their level, so a mesh is to be drawn on black, as it is by default.
    """

    level: int = Field(3, ge=0, le=255, description="brightest channel of an empty pixel, of 255")
    cells: int = Field(4, ge=1, le=64, description="random colours along each side of the image")


class BlurConfig(Strict):
    """Defocus and movement: a Gaussian with another width along each side of the image."""

    share: Share = Field(0.5, description="share of the images that are blurred")
    sigma: float = Field(
        0.02,
        ge=0,
        le=1,
        description="largest standard deviation, share of the image's side; drawn for each side",
    )


class OcclusionConfig(Strict):
    """Something that the scan does not have stands before the camera: a rectangle of one colour."""

    share: Share = Field(0.5, description="share of the images that are covered in part")
    area: ShareRange = Field((0.02, 0.2), description="share of the image that is covered")
    most_aspect: float = Field(3.0, ge=1, le=20, description="longer side by the shorter, at most")


class PhotometricConfig(Strict):
    """Photometric randomisation, in linear light and in the order in which a camera adds it."""

    unseen: UnseenConfig | None = Field(
        UnseenConfig(), description="empty pixels show random colours; null: they stay as they are"
    )
    field_ev: float = Field(
        0.2, ge=0, le=5, description="smooth change of the light: standard deviation, stops"
    )
    field_cells: int = Field(3, ge=1, le=64, description="independent values of it along each side")
    occlusion: OcclusionConfig | None = Field(
        OcclusionConfig(), description="rectangles; null: none"
    )
    blur: BlurConfig | None = Field(BlurConfig(), description="Gaussian blur; null: none")
    exposure_ev: StopsRange = Field((-0.7, 0.7), description="gain of all channels, stops")
    offset: OffsetRange = Field(
        (0.0, 0.01), description="black level and stray light, added everywhere; white is 1"
    )
    noise: NoiseConfig | None = Field(
        NoiseConfig(full_well_e=1000.0, read_e=2.0),
        description="shot and read noise of a pixel of the network's image; null: none",
    )
    white_balance_ev: float = Field(
        0.2, ge=0, le=5, description="gains of red and of blue beside green: largest, stops"
    )
