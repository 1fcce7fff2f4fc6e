"""What a trained localizer is: enough to build it again and to know which pictures it can read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from synfeal.config.collection import Count, Finite, Positive, Strict
from synfeal.config.load import describe
from synfeal.config.models import LocalizerConfig, ModelName, NetworkConfig
from synfeal.errors import InputError, why
from synfeal.files import read_json


class FrameCamera(Strict):
    """The camera of the training frames, before they were made smaller; pixels."""

    width: Count = Field(description="width of a frame")
    height: Count = Field(description="height of a frame")
    fx: Positive = Field(description="focal length along x")
    fy: Positive = Field(description="focal length along y")
    cx: Finite = Field(description="principal point, x")
    cy: Finite = Field(description="principal point, y")
    distortion: tuple[Finite, ...] = Field((), description="`k1, k2, p1, p2, k3`")

    @property
    def fov_deg(self) -> tuple[float, float]:
        """Field of view across and down."""
        sides = ((self.fx, self.cx, self.width), (self.fy, self.cy, self.height))
        across, down = (
            math.degrees(math.atan(centre / focal) + math.atan((side - centre) / focal))
            for focal, centre, side in sides
        )
        return across, down

    @property
    def short_side_fov_deg(self) -> float:
        """Field of view along the short side, all of which a square view keeps but one pixel."""
        across, down = self.fov_deg
        return across if self.width < self.height else down


class ModelDescription(Strict):
    """What stands in a checkpoint beside its weights."""

    localizer: ModelName = Field(description="name of the localizer")
    network: NetworkConfig = Field(description="shape it was built with")
    hyper: LocalizerConfig = Field(description="hyper-parameters it was built with")
    camera: FrameCamera | None = Field(None, description="of the training frames, where known")


def parse_description(value: Any, path: Path) -> ModelDescription:
    """The description that a checkpoint ``path`` holds.

    Raises:
        InputError: it lacks one, or holds another.
    """
    try:
        return ModelDescription.model_validate(value)
    except ValidationError as error:
        reason = describe(error, ModelDescription)
        raise InputError(f"{path}: its description cannot be used ({reason})") from None


def frame_camera(frames: Path) -> FrameCamera | None:
    """The camera of packed frames by the record beside them; None where there is no record.

    Raises:
        InputError: the record is damaged.
    """
    record = frames.with_suffix(".json")
    if not record.exists():
        return None
    try:
        camera = read_json(record)["camera"]
        return FrameCamera.model_validate({key: camera[key] for key in FrameCamera.model_fields})
    except (OSError, ValueError, TypeError, LookupError) as error:
        raise InputError(
            f"{record}: cannot be read as the record of packed frames ({why(error)});"
            " pack them again"
        ) from None
