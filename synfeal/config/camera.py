"""Typed configuration of a camera, which is plain numbers once it is read."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from synfeal.camera.calibration_files import read_calibration
from synfeal.camera.intrinsics import Intrinsics
from synfeal.camera.rays import refuse_fold
from synfeal.config.collection import Finite, Positive, Strict
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
    horizontal_fov_deg: float = Field(
        60.0, gt=1, lt=170, description="field of view; unused with fx"
    )
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
        raise ValueError(f"calibration: {error}") from None
    kept = {name: value for name, value in values.items() if name not in fixed}
    return {**kept, **asdict(calibration), "calibration": None}
