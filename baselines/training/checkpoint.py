"""Trained localizers on disk: weights, image statistics, and a description of what they are."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch
from pydantic import Field, SerializeAsAny, ValidationError, ValidationInfo, field_validator

from baselines.config.learning import (
    AugmentationConfig,
    LocalizerConfig,
    ModelName,
    NetworkConfig,
    hyper_of,
)
from baselines.localizers.base import Localizer
from baselines.localizers.memory import is_out_of_memory, memory_errors
from baselines.localizers.registry import build_localizer
from baselines.localizers.saved import checked_state, load_saved
from baselines.training.data import ImageStatistics
from baselines.training.resume import serialised
from baselines.training.typicality import Calibration
from synfeal.config.load import describe
from synfeal.config.types import Count, Finite, Positive, Strict
from synfeal.errors import InputError, why
from synfeal.records.files import atomic_path, read_json


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


Row = tuple[Finite, Finite, Finite, Finite]
Point = tuple[Finite, Finite, Finite]


# Share of the error of a constant answer that a localizer's may be where it has not been.
TELLING = 0.5


class UnseenScore(Strict):
    """Median errors of a localizer on frames of places that it has not learned from."""

    frames: Literal["test split", "held out"] = Field(description="which frames those are")
    n_frames: Count = Field(description="number of them")
    position_m: Finite | None = Field(description="position error; none where most have no pose")
    orientation_deg: Finite | None = Field(description="orientation error, likewise")
    constant_m: Finite = Field(description="position error of always answering the training mean")

    @property
    def knows_place(self) -> bool:
        """Check whether the localizer does clearly better than always answering the same."""
        return self.position_m is not None and self.position_m <= TELLING * self.constant_m


class ModelDescription(Strict):
    """Description of a trained localizer, stored beside its weights."""

    unless_none = ("sequence_from_world", "bounds_m", "rotations", "scene", "unseen")

    localizer: ModelName = Field(description="name of the localizer")
    network: NetworkConfig = Field(description="shape it was built with")
    hyper: SerializeAsAny[LocalizerConfig] = Field(description="hyper-parameters it was built with")
    camera: FrameCamera | None = Field(None, description="of the training frames, where known")
    sequence_from_world: tuple[Row, Row, Row, Row] | None = Field(
        None,
        description="from the world of the training labels to that of the sequence which the place"
        " was scanned from, where they differ",
    )
    bounds_m: tuple[Point, Point] | None = Field(
        None, description="corners of the box that the training positions lie in"
    )
    rotations: AugmentationConfig | None = Field(
        None, description="that training images were turned by, where they were"
    )
    scene: str | None = Field(None, description="name of the place it was trained in")
    unseen: UnseenScore | None = Field(
        None, description="its errors where it has not been, if they were measured"
    )

    @field_validator("hyper", mode="before")
    @classmethod
    def _by_own_model(cls, value: object, info: ValidationInfo) -> object:
        model = hyper_of(info.data["localizer"]) if "localizer" in info.data else LocalizerConfig
        return value if model is LocalizerConfig else model.model_validate(value)


def frame_camera(frames: Path) -> FrameCamera | None:
    """Read the perspective camera of packed frames from the record beside them, if there is one.

    Raises:
        InputError: the record is damaged.
    """
    record = frames.with_suffix(".json")
    if not record.exists():
        return None
    try:
        camera = read_json(record)["camera"]
        if isinstance(camera, dict) and camera.get("projection") is not None:
            return None
        return FrameCamera.model_validate({key: camera[key] for key in FrameCamera.model_fields})
    except (OSError, ValueError, TypeError, LookupError) as error:
        raise InputError(
            record,
            f"cannot be read as the record of packed frames ({why(error)})",
            "pack them again",
        ) from error


@dataclass(frozen=True)
class TrainedLocalizer:
    """A localizer that was read from a checkpoint, ready for prediction.

    Attributes:
        description: Description of the localizer.
        network: The network on its device, in evaluation mode.
        statistics: Statistics of the images that it was trained on.
        calibration: Tells pictures of another place, where it has one.
    """

    description: ModelDescription
    network: Localizer
    statistics: ImageStatistics
    calibration: Calibration | None = None

    @property
    def device(self) -> torch.device:
        """Return the device that the network is on."""
        return self.statistics.mean.device


def save_atomically(path: Path, value: Any) -> None:
    """Write what ``torch.load`` reads, under its name only when it is whole."""
    content = serialised(value)
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


def save_checkpoint(
    path: Path,
    localizer: Localizer,
    statistics: ImageStatistics,
    description: ModelDescription,
    calibration: Calibration | None = None,
) -> None:
    """Write everything prediction needs: tensors and plain values, so that reading runs no code.

    Args:
        path: File to write.
        localizer: Network whose weights are stored, on any device.
        statistics: Statistics of the images that it was trained on.
        description: What it is and how to build it again.
        calibration: Tells pictures of another place; None where that was not calibrated.
    """
    checkpoint = {
        "description": description.model_dump(mode="json"),
        "localizer": {name: v.detach().cpu() for name, v in localizer.state_dict().items()},
        "images": {"mean": statistics.mean.cpu(), "deviation": statistics.deviation.cpu()},
    }
    if calibration is not None:
        checkpoint["calibration"] = calibration._asdict()
    save_atomically(path, checkpoint)


@memory_errors()
def read_checkpoint(path: Path, device: torch.device) -> TrainedLocalizer:
    """Build the localizer that a checkpoint describes, with its weights, on ``device``.

    Raises:
        InputError: The file is missing or damaged, is no checkpoint, or is one without description.
        MemoryError: The device has too little memory for the localizer.
    """
    content = _read(path, device)
    if "description" not in content:
        raise InputError(
            path,
            "does not say which localizer it is (written before checkpoints did)",
            "train it again",
        )
    try:
        description = ModelDescription.model_validate(_with_auxiliary(content))
    except ValidationError as error:
        reason = describe(error)
        raise InputError(path, f"its description cannot be used ({reason})") from error
    network = build_localizer(description.localizer, description.network, description.hyper)
    network.place_on(device)
    try:
        network.load_state_dict(checked_state(content["localizer"]))
        statistics = _statistics(content["images"])
        calibration = _calibration(content.get("calibration"))
    except (RuntimeError, ValueError) as error:
        if is_out_of_memory(error):
            raise
        raise InputError(
            path,
            f"its weights are not those of the {description.localizer} it describes",
            "train it again",
        ) from error
    return TrainedLocalizer(description, network.eval(), statistics, calibration)


def _with_auxiliary(content: dict[str, Any]) -> Any:
    """Return a description that says whether there are auxiliary regressors.

    Those of version 0.1 do not: PoseNet alone had them then, so the weights tell.
    """
    described, weights = content["description"], content["localizer"]
    if not isinstance(described, dict) or not isinstance(weights, dict):
        return described
    hyper = described.get("hyper")
    if not isinstance(hyper, dict) or "auxiliary" in hyper:
        return described
    heads = any(str(name).startswith("auxiliary") for name in weights)
    return {**described, "hyper": {**hyper, "auxiliary": heads}}


def _read(path: Path, device: torch.device) -> dict[str, Any]:
    if not path.is_file():
        raise InputError(path, "there is no such file", "name the model.pt of a training run")
    try:
        content = load_saved(path, device)
    except (OSError, ValueError) as error:
        raise InputError(
            path, "is damaged or no trained localizer", "name the model.pt of a training run"
        ) from error
    if not isinstance(content, dict) or not {"localizer", "images"} <= content.keys():
        raise InputError(path, "holds no trained localizer", "name the model.pt of a training run")
    return content


def _statistics(stored: object) -> ImageStatistics:
    """Read image statistics as they are stored.

    Raises:
        ValueError: They are not a mean and a positive deviation (1, 3, 1, 1).
    """
    values = checked_state(stored)
    if values.keys() != {"mean", "deviation"}:
        raise ValueError("its image statistics are not a mean and a deviation")
    for value in values.values():
        if value.shape != (1, 3, 1, 1) or not value.isfinite().all():
            raise ValueError("its image statistics are damaged")
    if not (values["deviation"] > 0).all():
        raise ValueError("its image statistics have no standard deviation")
    return ImageStatistics(mean=values["mean"], deviation=values["deviation"])


def _calibration(stored: object) -> Calibration | None:
    """Read the calibration as it is stored; None in checkpoints written before there was any.

    Raises:
        ValueError: It is damaged.
    """
    if stored is None:
        return None
    values = checked_state(stored)
    if values.keys() != set(Calibration._fields):
        raise ValueError("its calibration is not that of features and distances")
    features, distance = values["features"].cpu(), values["distance"].cpu()
    if features.dim() != 2 or distance.dim() != 1 or not len(features) or not len(distance):
        raise ValueError("its calibration is damaged")
    if not (features.isfinite().all() and (distance.diff() >= 0).all()):
        raise ValueError("its calibration is damaged")
    return Calibration(features=features, distance=distance)
