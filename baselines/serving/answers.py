"""Answers of the server, as JSON.

A pose is given twice: plainly, and as an OGC GeoPose (OGC 21-056r11, GeoPose 1.0), whose form
*Advanced* names the frame that its quaternion is relative to. A place that was scanned indoors has
no latitude and longitude. Its frame is local, then: one of this program, whose parameters say where
in the world of the place its origin lies, with the axes of that world.
"""

from __future__ import annotations

import base64
import math
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from baselines.references.map_localizer import FOUND, Status
from baselines.serving.place import Found, ServedPlace
from synfeal.dataset.pose_table import COLUMNS

AUTHORITY = "synfeal"
POSE = COLUMNS[2:]


class Vector(BaseModel):
    """A position, metres."""

    x: float
    y: float
    z: float


class Quaternion(BaseModel):
    """A rotation as a unit quaternion, ``w`` not negative."""

    x: float
    y: float
    z: float
    w: float


class Pose(BaseModel):
    """``world_from_cam``: the camera's centre, and the rotation from its axes to the world's."""

    position: Vector
    quaternion: Quaternion


class FrameSpecification(BaseModel):
    """A frame of reference, as OGC GeoPose names them."""

    authority: str
    id: str
    parameters: str


class GeoPose(BaseModel):
    """An OGC GeoPose 1.0 of the form Advanced."""

    frameSpecification: FrameSpecification  # noqa: N815 (the standard's)
    quaternion: Quaternion


class Camera(BaseModel):
    """Camera of the upright photograph, pixels; the first pixel's centre is at 0.5."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: list[float] = Field(description="k1, k2, p1, p2, k3")


class Answer(BaseModel):
    """Answer about one photograph: its pose, or that it has none."""

    model_config = ConfigDict(extra="allow")  # further columns of synfeal localize

    image: str
    status: Status
    world: str = Field(description="world of the pose: sequence, mesh, or map")
    pose: Pose | None = Field(
        description="null unless localized; camera axes are x right, y down, z forward"
    )
    geopose: GeoPose | None
    inliers: int
    confidence: float
    position_sd_m: float | None = Field(None, description="standard deviation, stated error")
    position_95_m: float | None = Field(None, description="19 of 20 poses are no farther off")
    orientation_sd_deg: float | None = None
    orientation_95_deg: float | None = None
    camera: Camera
    seconds: float = Field(description="time it took, waiting left out")
    rendering: str | None = Field(
        None, description="what the place looks like from the pose, as the address of a JPEG"
    )


class Health(BaseModel):
    """State of the server."""

    status: str
    place: str
    world: str
    frames: int
    features: int
    renderings: bool
    answered: int = Field(description="photographs answered, localized or not")
    pending: int = Field(description="photographs that come in, wait or are localized")


class Problem(BaseModel):
    """Why a request was not served."""

    error: str


def answer_of(found: Found, name: str, place: ServedPlace) -> dict[str, Any]:
    """Describe where a photograph was taken, as :class:`Answer`.

    Args:
        found: Where it was taken.
        name: Its name.
        place: The place.
    """
    located = found.located
    row = {key: _finite(value) for key, value in located.row.items()}
    values = dict(zip(POSE, (row.pop(key) for key in POSE), strict=True))
    pose = pose_of(values) if located.status == FOUND else None
    seen_by = located.calibration
    rendering = None
    if found.rendering is not None:
        rendering = f"data:image/jpeg;base64,{base64.b64encode(found.rendering).decode('ascii')}"
    return {
        "image": name,
        "world": place.world,
        **row,
        "pose": pose,
        "geopose": None if pose is None else geopose_of(pose, f"{place.name}/{place.world}"),
        "camera": {
            "width": seen_by.width,
            "height": seen_by.height,
            "fx": seen_by.fx,
            "fy": seen_by.fy,
            "cx": seen_by.cx,
            "cy": seen_by.cy,
            "distortion": list(seen_by.distortion),
        },
        "seconds": round(found.seconds, 4),
        "rendering": rendering,
    }


def pose_of(values: dict[str, Any]) -> dict[str, Any]:
    """Write a pose by the columns of a table of poses as :class:`Pose`."""
    return {
        "position": {axis: values[f"t{axis}"] for axis in "xyz"},
        "quaternion": {axis: values[f"q{axis}"] for axis in "xyzw"},
    }


def geopose_of(pose: dict[str, Any], frame: str) -> dict[str, Any]:
    """Write a pose as an OGC GeoPose.

    Args:
        pose: As :func:`pose_of` writes it.
        frame: Name of the world that it is in.
    """
    position = pose["position"]
    return {
        "frameSpecification": {
            "authority": AUTHORITY,
            "id": frame,
            "parameters": "&".join(f"{axis}={position[axis]}" for axis in "xyz"),
        },
        "quaternion": pose["quaternion"],
    }


def _finite(value: Any) -> Any:
    """Return a cell of a table as JSON has it."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
