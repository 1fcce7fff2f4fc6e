"""Typed configuration of what is collected: scenes, the camera and its movement."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Slug = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_]*$")]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, lt=1)]
Count = Annotated[int, Field(ge=1)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Interval = tuple[Finite, Finite]


class Strict(BaseModel):
    """A model that refuses unknown keys and cannot be changed after it was checked."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _ordered(name: str, interval: Interval) -> None:
    if not interval[0] < interval[1]:
        raise ValueError(f"{name}: the first number must be below the second, got {list(interval)}")


class Box(Strict):
    """An axis-aligned box in the world, metres."""

    x: Interval = Field(description="lower and upper bound along x, metres")
    y: Interval = Field(description="lower and upper bound along y, metres")
    z: Interval = Field(description="lower and upper bound along z, metres")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for axis in ("x", "y", "z"):
            _ordered(axis, getattr(self, axis))
        return self


class Angles(Strict):
    """Admissible angles of the camera, degrees."""

    roll_deg: Interval = Field((-29.8, 29.8), description="roll bounds, degrees")
    pitch_deg: Interval = Field((-29.8, 29.8), description="pitch bounds, degrees")
    yaw_deg: Interval = Field((0.0, 360.0), description="yaw bounds, degrees")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("roll_deg", "pitch_deg", "yaw_deg"):
            _ordered(name, getattr(self, name))
        if not -90 < self.pitch_deg[0] < self.pitch_deg[1] < 90:
            raise ValueError(
                "pitch_deg: must lie within -90 and 90, where yaw and roll are distinct"
            )
        return self


class SizeConfig(Strict):
    """Frames of a data set at full scale, as the paper prints them."""

    train: Count = Field(description="training frames at scale 1")
    test: Count = Field(description="test frames at scale 1")


class SceneConfig(Strict):
    """One scene: where its mesh comes from and where the camera may go."""

    source: Literal["procedural", "mesh"] = Field(
        description="`procedural` builds the stand-in of this name; `mesh` reads `path`"
    )
    builder: Literal["large_room", "sanctuary", "pretext_room"] | None = Field(
        None, description="procedural scenes: which stand-in to build"
    )
    path: Path | None = Field(
        None, description="mesh scenes: the file to read (.glb, .gltf, .obj, .ply)"
    )
    sha256: str | None = Field(
        None,
        pattern=r"^[0-9a-f]{64}$",
        description="mesh scenes: expected hash of the file, if any",
    )
    up_axis: Literal["auto", "y", "z"] = Field(
        "auto", description="axis that points up in the file; `auto` takes y for glTF, z otherwise"
    )
    unit_m: Positive = Field(1.0, description="length of one unit of the file in metres")
    sampling_box: Box | None = Field(
        None, description="where camera centres are sampled; the mesh's bounds when absent"
    )
    angles: Angles = Field(default_factory=Angles, description="angle bounds of sampled poses")
    min_view_distance_m: NonNegative = Field(
        1.2,
        description="least free distance along the optical axis of a target pose (the paper's d)",
    )
    sizes: dict[str, SizeConfig] = Field(
        default_factory=dict, description="data set sizes by the paper's names, at scale 1"
    )

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.source == "procedural" and self.builder is None:
            raise ValueError(
                "builder: a procedural scene needs one of large_room, sanctuary, pretext_room"
            )
        if self.source == "mesh" and self.path is None:
            raise ValueError("path: a scene with `source: mesh` needs the path of its mesh file")
        return self


class CollectionConfig(Strict):
    """How the camera moves (section 3 of the paper)."""

    candidates: Count = Field(8, description="target pose candidates per path (the paper's k)")
    frame_spacing_m: Positive = Field(
        0.03, description="distance between frames (the paper's other d)"
    )
    min_path_m: NonNegative = Field(1.5, description="shorter paths are drawn again")
    max_tries: Count = Field(
        2000, description="rounds of candidates before a scene is called too narrow"
    )
    interpolation: Literal["rpy", "slerp"] = Field(
        "rpy",
        description="`rpy` is the paper's component-wise interpolation, each angle the short way",
    )
    collision_agreement: Annotated[float, Field(gt=0.5, le=1)] = Field(
        0.995,
        description="share of a planner's decisions on which the decimated collision mesh must"
        " agree with the full mesh; 1 keeps all that any of 10,000 decisions needs",
    )


class CameraConfig(Strict):
    """A camera: field of view or calibrated intrinsics, and lens distortion.

    With a field of view alone pixels are square and the principal point is the image centre.
    """

    width: Annotated[int, Field(ge=16, le=8192)] = Field(640, description="image width, pixels")
    height: Annotated[int, Field(ge=16, le=8192)] = Field(480, description="image height, pixels")
    horizontal_fov_deg: Annotated[float, Field(gt=1, lt=170)] = Field(
        60.0, description="horizontal field of view, degrees; unused where fx is given"
    )
    fx: Positive | None = Field(None, description="focal length along x, pixels")
    fy: Positive | None = Field(None, description="focal length along y, pixels")
    cx: Finite | None = Field(None, description="principal point, pixels from the left edge")
    cy: Finite | None = Field(None, description="principal point, pixels from the top edge")
    distortion: tuple[Finite, Finite, Finite, Finite, Finite] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        description="Brown-Conrady coefficients in OpenCV's order: k1, k2, p1, p2, k3",
    )
    near_m: Positive = Field(0.05, description="near clip plane, metres")
    far_m: Positive = Field(100.0, description="far clip plane, metres")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.near_m >= self.far_m:
            raise ValueError("near_m: must be below far_m")
        intrinsics = (self.fx, self.fy, self.cx, self.cy)
        if None in intrinsics and intrinsics != (None,) * 4:
            raise ValueError("fx: fx, fy, cx and cy are given together or not at all")
        return self


class RenderConfig(Strict):
    """How images are drawn."""

    backend: Literal["auto", "opengl", "pyrender", "raycast"] = Field(
        "auto", description="`auto` takes the fastest that works on this machine, and says which"
    )
