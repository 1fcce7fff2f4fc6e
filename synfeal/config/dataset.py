"""Cameras, how frames are drawn, and the part of a profile that data sets are made of."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from synfeal.camera.calibration import read_calibration
from synfeal.camera.projection import Intrinsics, refuse_fold
from synfeal.config.collection import (
    Channel,
    CollectionConfig,
    Count,
    Finite,
    Positive,
    SceneConfig,
    Seed,
    Slug,
    Strict,
    part,
)
from synfeal.config.effects import EffectsConfig, refuse_long_exposure
from synfeal.errors import InputError


class CameraConfig(Strict):
    """A camera: field of view or calibrated intrinsics, and lens distortion.

    With a field of view alone pixels are square and the principal point is the image centre. A
    calibration is replaced by its numbers when it is read, so a file that changes or moves later
    changes nothing.
    """

    calibration: Path | None = Field(
        None,
        exclude=True,
        description="file of intrinsics and distortion (docs/cameras.md), scaled to width and"
        " height where given",
    )
    width: int = Field(640, ge=16, le=8192, description="pixels")
    height: int = Field(480, ge=16, le=8192, description="pixels")
    horizontal_fov_deg: float = Field(60.0, gt=1, lt=170, description="without fx: field of view")
    fx: Positive | None = Field(None, description="focal length, pixels")
    fy: Positive | None = Field(None, description="focal length, pixels")
    cx: Finite | None = Field(None, description="principal point, pixels")
    cy: Finite | None = Field(None, description="principal point, pixels")
    distortion: tuple[Finite, Finite, Finite, Finite, Finite] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0), description="k1, k2, p1, p2, k3 (Brown-Conrady, as OpenCV)"
    )
    near_m: Positive = Field(0.05, description="near clip plane")
    far_m: Positive = Field(100.0, description="far clip plane")

    @model_validator(mode="before")
    @classmethod
    def _read_calibration(cls, values: Any) -> Any:
        if not isinstance(values, dict) or values.get("calibration") is None:
            return values
        return _calibrated(values)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.near_m >= self.far_m:
            raise ValueError("near_m: must be below far_m")
        intrinsics = (self.fx, self.fy, self.cx, self.cy)
        if None in intrinsics and intrinsics != (None,) * 4:
            raise ValueError("fx: fx, fy, cx and cy are given together or not at all")
        if any(self.distortion):
            refuse_fold(self)
        return self

    @property
    def intrinsics(self) -> Intrinsics:
        """Those given, or those of the field of view."""
        given = (self.fx, self.fy, self.cx, self.cy)
        if None in given:
            return Intrinsics.of_view(self.width, self.height, self.horizontal_fov_deg)
        return Intrinsics(*map(float, given))  # type: ignore[arg-type]

    @property
    def record(self) -> dict[str, Any]:
        """With its intrinsics, ready for JSON."""
        return {**self.model_dump(mode="json"), **self.intrinsics._asdict()}


def _calibrated(values: dict[str, Any]) -> dict[str, Any]:
    """A camera's values with those of its calibration in place of the path."""
    fixed = ("horizontal_fov_deg", "fx", "fy", "cx", "cy", "distortion")
    for name in fixed:
        if values.get(name) is not None:
            raise ValueError(f"calibration: {name} comes from the file; leave one of the two out")
    sides = [values.get(name) for name in ("width", "height")]
    for name, side in zip(("width", "height"), sides, strict=True):
        if side is not None and not (type(side) is int and side > 0):
            raise ValueError(f"{name}: must be a whole number of pixels, found {side!r}")
    path = values["calibration"]
    if not isinstance(path, str | Path):
        raise ValueError(f"calibration: must be a path, found {path!r}")
    try:
        calibration = read_calibration(Path(path)).scaled(*sides)
    except (InputError, ValueError) as error:
        raise ValueError(f"calibration: {error}") from error
    kept = {name: value for name, value in values.items() if name not in fixed}
    return {**kept, **asdict(calibration), "calibration": None}


class RenderConfig(Strict):
    """How images are drawn."""

    unless_none = ("effects",)

    backend: Literal["auto", "opengl", "pyrender", "raycast"] = Field(
        "auto", description="`auto`: the fastest that works here"
    )
    supersampling: int = Field(2, ge=1, le=4, description="samples per pixel along each axis")
    detail: Literal["auto", "full"] = Field(
        "auto",
        description="of the mesh that colours are drawn of: `auto` leaves out what the camera's"
        " resolution does not show, `full` nothing; depth is always that of the full mesh",
    )
    background_rgb: tuple[Channel, Channel, Channel] = Field((0, 0, 0), description="where empty")
    effects: EffectsConfig | None = Field(None, description="added to frames (docs/variation.md)")

    @property
    def draws_full_mesh(self) -> bool:
        """Check whether colours are drawn from the full mesh.

        Where light is switched they always are: shares of light are multiplied pixel by pixel, and
        belong to the mesh they were baked on.
        """
        light = self.effects and self.effects.light
        return self.detail == "full" or bool(light and light.states)


class DatasetConfig(Strict):
    """Scenes, how many frames of them, and how they are planned and drawn."""

    profile: Slug = Field(description="name, and directory under `results`")
    seed: Seed = Field(0, description="root of all seeds")
    scale: float = Field(gt=0, le=1, description="share of the paper's frames")
    results: Path = Field(Path("results"), description="where runs are written")
    shard_frames: Count = Field(500, description="frames of a render job, and of a sequence")
    archive_sequences: bool = Field(False, description="write a sequence as one `seq-XX.zip`")
    scenes: dict[Slug, SceneConfig] = Field(description="scenes by name")
    collection: CollectionConfig = part(CollectionConfig, "camera movement")
    network_camera: CameraConfig = part(CameraConfig, "camera of the localizers' frames")
    network_depth: bool = Field(False, description="write its depth images too")
    render: RenderConfig = part(RenderConfig, "how frames are drawn")

    @model_validator(mode="after")
    def _check_effects(self) -> Self:
        if self.render.effects is not None:
            refuse_long_exposure(self.render.effects, self.collection, "render.effects")
            light = self.render.effects.light
            if light and light.states and any(s.source == "mesh" for s in self.scenes.values()):
                raise ValueError(
                    "render.effects.light.states: nothing is known of the lamps of a mesh of your"
                    " own; use ev, temperature_k and field_ev"
                )
            if light and light.states and any(s.clutter for s in self.scenes.values()):
                raise ValueError(
                    "render.effects.light.states: nothing is known of the light on objects; leave"
                    " out the clutter of the scenes"
                )
        return self

    @property
    def root(self) -> Path:
        """Directory of this profile's results."""
        return self.results / self.profile

    def n_frames(self, scene: str, size: str, split: str) -> int:
        """Frames of a split at this profile's scale: at least 2, where there are as many."""
        full: int = getattr(self.scenes[scene].sizes[size], split)
        return max(min(2, full), round(full * self.scale))
