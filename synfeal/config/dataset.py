"""Typed configuration of what frames are drawn with: cameras and rendering."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from synfeal.camera.calibration import read_calibration
from synfeal.camera.fisheye import EQUIDISTANT, largest_angle_rad, radius_of_angle
from synfeal.camera.projection import Intrinsics, Projection, refuse_fold
from synfeal.config.collection import CollectionConfig, SceneConfig
from synfeal.config.effects import EffectsConfig, refuse_long_exposure
from synfeal.config.types import Channel, Finite, Positive, Strict
from synfeal.errors import InputError

# 10 m a unit is no depth any more, and 0.01 mm ends at 0.66 m.
DepthUnitsPerM = Annotated[float, Field(ge=0.1, le=1e5)]
StereoBaseline = Annotated[float, Field(ge=1e-4, le=100.0)]


class CameraConfig(Strict):
    """A camera: field of view or calibrated intrinsics, and lens distortion.

    With a field of view alone pixels are square and the principal point is the image centre. A
    calibration is replaced by its numbers when it is read, so a file that changes or moves later
    changes nothing. Panoramas have no intrinsics; they are twice as wide as high.
    """

    unless_none = ("projection", "fisheye_k", "stereo_baseline_m", "depth_units_per_m")

    calibration: Path | None = Field(
        None,
        exclude=True,
        description="file of intrinsics and distortion (docs/cameras.md), scaled to width and"
        " height where given",
    )
    width: int = Field(640, ge=16, le=8192, description="pixels")
    height: int = Field(480, ge=16, le=8192, description="pixels")
    horizontal_fov_deg: float = Field(
        60.0, gt=1, le=360, description="without fx: field of view; perspective cameras: below 170"
    )
    fx: Positive | None = Field(None, description="focal length, pixels")
    fy: Positive | None = Field(None, description="focal length, pixels")
    cx: Finite | None = Field(None, description="principal point, pixels")
    cy: Finite | None = Field(None, description="principal point, pixels")
    distortion: tuple[Finite, Finite, Finite, Finite, Finite] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0), description="k1, k2, p1, p2, k3 (Brown-Conrady, as OpenCV)"
    )
    projection: Projection | None = Field(
        None,
        description="null: perspective, with `distortion`; `fisheye`: Kannala-Brandt;"
        " `equirectangular`: a panorama of 360 x 180 degrees. Depth of the last two is along the"
        " ray",
    )
    fisheye_k: tuple[Finite, Finite, Finite, Finite] | None = Field(
        None, description="fisheye: k1, k2, k3, k4, as OpenCV; null: equidistant"
    )
    stereo_baseline_m: StereoBaseline | None = Field(
        None, description="draw a second camera this far to the right, too"
    )
    near_m: Positive = Field(0.05, description="near clip plane")
    far_m: Positive = Field(100.0, description="far clip plane")
    depth_units_per_m: DepthUnitsPerM | None = Field(
        None,
        description="stored value of a depth of one metre; null: 1000, millimetres, up to 65.5 m",
    )

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        if values.get("calibration") is not None:
            values = _calibrated(values)
        return {**_usual_view(values), **values}

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.near_m >= self.far_m:
            raise ValueError("near_m: must be below far_m")
        intrinsics = (self.fx, self.fy, self.cx, self.cy)
        if None in intrinsics and intrinsics != (None,) * 4:
            raise ValueError("fx: fx, fy, cx and cy are given together or not at all")
        if self.projection is not None and any(self.distortion):
            raise ValueError("distortion: is that of perspective cameras; leave it out")
        if self.fisheye_k is not None and self.projection != "fisheye":
            raise ValueError("fisheye_k: goes with the projection fisheye")
        if self.projection == "equirectangular":
            self._check_panorama()
        elif self.projection is None and self.fx is None and self.horizontal_fov_deg >= 170:
            raise ValueError(
                "horizontal_fov_deg: must be below 170, or the projection fisheye or"
                " equirectangular"
            )
        elif self.projection == "fisheye" and self.fx is None:
            widest_deg = 2.0 * math.degrees(largest_angle_rad(self.fisheye_k or EQUIDISTANT))
            if self.horizontal_fov_deg > widest_deg:
                raise ValueError(
                    f"horizontal_fov_deg: with these fisheye_k at most {widest_deg:.1f}, where the"
                    " lens folds over"
                )
        if any(self.distortion):
            refuse_fold(self)
        return self

    def _check_panorama(self) -> None:
        if self.width != 2 * self.height:
            raise ValueError(
                f"width: an equirectangular image is twice as wide as high, found {self.width} x"
                f" {self.height}; give one of the two"
            )
        if self.fx is not None or self.horizontal_fov_deg != 360.0:
            name = "horizontal_fov_deg" if self.fx is None else "fx"
            raise ValueError(f"{name}: an equirectangular image shows all directions; leave it out")

    @property
    def intrinsics(self) -> Intrinsics:
        """Those given, or those of the field of view.

        Raises:
            ValueError: the camera is equirectangular and has none.
        """
        if self.projection == "equirectangular":
            raise ValueError("an equirectangular camera has no focal length")
        given = (self.fx, self.fy, self.cx, self.cy)
        if None not in given:
            return Intrinsics(*map(float, given))  # type: ignore[arg-type]
        if self.projection is None:
            return Intrinsics.of_view(self.width, self.height, self.horizontal_fov_deg)
        half_rad = np.array(math.radians(self.horizontal_fov_deg) / 2.0)
        edge = float(radius_of_angle(half_rad, self.fisheye_k or EQUIDISTANT))
        focal = self.width / 2.0 / edge
        return Intrinsics(focal, focal, self.width / 2.0, self.height / 2.0)

    @property
    def record(self) -> dict[str, Any]:
        """With its intrinsics, ready for JSON."""
        values = self.model_dump(mode="json")
        if self.projection == "equirectangular":
            return {key: value for key, value in values.items() if key not in Intrinsics._fields}
        return {**values, **self.intrinsics._asdict()}


def _usual_view(values: dict[str, Any]) -> dict[str, Any]:
    """Fill in the field of view and sides of a projection where they are not given."""
    if values.get("projection") == "fisheye":
        return {"horizontal_fov_deg": 180.0}
    if values.get("projection") != "equirectangular":
        return {}
    sides = {"width": 1024, "height": 512}
    width, height = values.get("width"), values.get("height")
    if isinstance(width, int) and height is None:
        sides["height"] = width // 2
    if isinstance(height, int) and width is None:
        sides["width"] = 2 * height
    return {"horizontal_fov_deg": 360.0, **sides}


def _calibrated(values: dict[str, Any]) -> dict[str, Any]:
    """Replace the path of a calibration in a camera's values by what it says."""
    lens = ("fx", "fy", "cx", "cy", "distortion", "projection", "fisheye_k")
    fixed = ("horizontal_fov_deg", *lens)
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
        calibration = read_calibration(Path(path), with_fisheye=True).scaled(*sides)
    except (InputError, ValueError) as error:
        raise ValueError(f"calibration: {error}") from error
    kept = {name: value for name, value in values.items() if name not in fixed}
    return {**kept, **asdict(calibration), "calibration": None}


Backend = Literal["auto", "opengl", "pyrender", "raycast"]
Detail = Literal["auto", "full"]
Shade = Literal["headlight", "ambient"]


class RenderConfig(Strict):
    """Settings of the renderer."""

    unless_none = ("effects", "shade")

    backend: Backend = Field("auto", description="`auto`: the fastest that works here")
    supersampling: int = Field(2, ge=1, le=4, description="samples per pixel along each axis")
    detail: Detail = Field(
        "auto",
        description="of the mesh that colours are drawn of: `auto` leaves out what the camera's"
        " resolution does not show, `full` nothing; depth is always that of the full mesh",
    )
    background_rgb: tuple[Channel, Channel, Channel] = Field((0, 0, 0), description="where empty")
    effects: EffectsConfig | None = Field(None, description="added to frames (docs/variation.md)")
    shade: Shade | None = Field(
        None,
        description="light for meshes without texture: `headlight`, a lamp at the camera;"
        " `ambient`, from everywhere, darker in corners (docs/collecting.md)",
    )

    @property
    def draws_full_mesh(self) -> bool:
        """Check whether colours are drawn from the full mesh.

        Where light is switched they always are: shares of light are multiplied pixel by pixel, and
        belong to the mesh they were baked on.
        """
        light = self.effects and self.effects.light
        return self.detail == "full" or bool(light and light.states)


def refuse_effects(
    render: RenderConfig,
    collection: CollectionConfig,
    camera: CameraConfig,
    scenes: Iterable[SceneConfig],
) -> None:
    """Refuse effects that cannot be drawn with the other settings.

    Raises:
        ValueError: One cannot; the message begins with its key below ``render``, as in
            ``effects.light.states``, or with the camera's ``stereo_baseline_m``.
    """
    if render.effects is None:
        return
    if camera.stereo_baseline_m is not None:
        raise ValueError(
            "stereo_baseline_m: effects are of one camera; leave out the effects, or draw the pair"
            " without"
        )
    refuse_long_exposure(render.effects, collection, "effects")
    light = render.effects.light
    if not (light and light.states):
        return
    for scene in scenes:
        if scene.source == "mesh":
            raise ValueError(
                "effects.light.states: nothing is known of the lamps of a mesh of your own; use"
                " ev, temperature_k and field_ev"
            )
        if scene.clutter:
            raise ValueError(
                "effects.light.states: nothing is known of the light on objects; leave out the"
                " clutter of the scenes"
            )


def origin_record(
    name: str, scene: SceneConfig, collection: CollectionConfig, render: RenderConfig, seed: int
) -> dict[str, Any]:
    """Return the settings that a data set comes from, less file names, ready for JSON.

    Args:
        name: Name of the scene.
        scene: Its settings.
        collection: Movement of the camera.
        render: How frames were drawn.
        seed: Root of all seeds.
    """
    kept = scene.model_dump(mode="json", include=set(SceneConfig.model_fields) - {"path", "sha256"})
    return {
        "scene": {"name": name, **kept},
        "collection": collection.model_dump(mode="json", exclude={"repeat"}),
        "render": render.model_dump(mode="json"),
        "seed": seed,
    }
