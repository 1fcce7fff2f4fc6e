"""Settings of one collection, flat: each field is an option of ``synfeal collect`` and of Python.

Fields take bounds and defaults from the models that the stages read (scene, movement, camera,
rendering), so that a value is checked alike however it is given.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    BaseModel,
    Field,
    PrivateAttr,
    ValidationError,
    field_validator,
    model_validator,
)

from synfeal.camera.projection import Projection
from synfeal.config.collection import (
    AROUND_DEG,
    AROUND_M,
    Angles,
    Box,
    ClutterConfig,
    CollectionConfig,
    Mode,
    SceneConfig,
    TestPaths,
    UpAxis,
)
from synfeal.config.dataset import (
    Backend,
    CameraConfig,
    DepthUnitsPerM,
    Detail,
    RenderConfig,
    Shade,
    StereoBaseline,
    refuse_effects,
)
from synfeal.config.effects import EffectsConfig
from synfeal.config.load import check_mesh_file, describe, read_yaml
from synfeal.config.shown import Shown
from synfeal.config.types import (
    MOST_FRAMES,
    Channel,
    Count,
    Finite,
    Fraction,
    Interval,
    NonNegative,
    Positive,
    Seed,
    Strict,
)
from synfeal.errors import Argument, InputError

Model = TypeVar("Model", bound=BaseModel)
SCENE = "scan"  # what records and seeds call the scene of a collection
TEST_PATHS = 8  # that the test frames of a collection are of, unless its settings say otherwise
# What fields are called in the models of the stages, where they have other names there.
KEYS = {
    "path": "mesh",
    "sampling_box": "box",
    "frame_spacing_m": "spacing_m",
    "repeat": "poses",
    "calibration": "camera",
    "horizontal_fov_deg": "fov_deg",
    "stereo_baseline_m": "stereo_m",
    "depth_units_per_m": "depth_scale",
    **dict.fromkeys(("fx", "fy", "cx", "cy", "distortion"), "camera"),
}


def _like(model: type[BaseModel], key: str, description: str) -> Any:
    """Define a field with the bounds and the default of another model's key."""
    field = copy(model.model_fields[key])
    field.description = description
    field._attributes_set = {**field._attributes_set, "description": description}
    return field


FROM_TO = Shown(("FROM", "TO"))
BoxBounds = tuple[Finite, Finite, Finite, Finite, Finite, Finite]


class PlaceConfig(Strict):
    """A mesh, and where cameras may be in it."""

    mesh: Path = Field(description="GLB, glTF, OBJ or PLY file")
    box: Annotated[tuple[BoxBounds, ...], Shown(("X0", "X1", "Y0", "Y1", "Z0", "Z1"))] = Field(
        (),
        description="where camera centres may be, metres (the mesh's bounds); repeat it for further"
        " rooms or floors",
    )
    up_axis: UpAxis = _like(SceneConfig, "up_axis", "axis that points up in the file")
    unit_m: float = _like(SceneConfig, "unit_m", "metres per unit of the file")

    @field_validator("mesh")
    @classmethod
    def _is_there(cls, mesh: Path) -> Path:
        try:
            check_mesh_file(mesh, "mesh")
        except InputError as error:
            raise ValueError(str(error).removeprefix("mesh: ")) from error
        return mesh

    @field_validator("box", mode="before")
    @classmethod
    def _several(cls, box: Any) -> Any:
        """Take one box for a list of one."""
        is_one = isinstance(box, list | tuple) and len(box) == 6 and not isinstance(box[0], tuple)
        return () if box is None else (box,) if is_one and not isinstance(box[0], list) else box

    @field_validator("box")
    @classmethod
    def _bounds(cls, boxes: tuple[BoxBounds, ...]) -> tuple[BoxBounds, ...]:
        for box in boxes:
            _part(Box, {"x": box[0:2], "y": box[2:4], "z": box[4:6]}, {})
        return boxes

    def _scene(self, **more: Any) -> SceneConfig:
        boxes = [{"x": b[0:2], "y": b[2:4], "z": b[4:6]} for b in self.box]
        return _part(
            SceneConfig,
            {
                "source": "mesh",
                "path": self.mesh,
                "up_axis": self.up_axis,
                "unit_m": self.unit_m,
                "sampling_box": boxes[0] if boxes else None,
                "further_boxes": boxes[1:],
                **more,
            },
        )

    @property
    def scene(self) -> SceneConfig:
        """The mesh and its boxes as the stages read them."""
        return self._scene()


class ViewConfig(Strict):
    """A camera, and how its images are drawn."""

    camera: Path | CameraConfig | None = Field(
        None, description="calibration: OpenCV or ROS .yaml or .json, COLMAP cameras.txt"
    )
    projection: Projection | None = Field(
        None,
        description="a lens in place of a perspective camera; depth is then along the ray"
        " (docs/cameras.md)",
    )
    fisheye_k: Annotated[
        tuple[Finite, Finite, Finite, Finite] | None, Shown(("K1", "K2", "K3", "K4"), "0 0 0 0")
    ] = Field(None, description="distortion coefficients of a fisheye, as in OpenCV")
    width: Annotated[
        Annotated[int, Field(ge=16, le=8192)] | None, Shown(("PX",), "640, or that of `camera`")
    ] = Field(None, description="image width, pixels")
    height: Annotated[
        Annotated[int, Field(ge=16, le=8192)] | None, Shown(("PX",), "480, or that of `camera`")
    ] = Field(None, description="image height, pixels")
    fov_deg: Annotated[
        Annotated[float, Field(gt=1, le=360)] | None, Shown(("DEG",), "60; fisheye 180")
    ] = Field(None, description="horizontal field of view, degrees")
    backend: Backend = _like(RenderConfig, "backend", "renderer")
    supersampling: int = _like(RenderConfig, "supersampling", "N x N samples per pixel, 1 - 4")
    shade: Annotated[Shade | None, Shown(default="none")] = _like(
        RenderConfig,
        "shade",
        "light for meshes without texture: a lamp at the camera, or ambient light baked into the"
        " mesh",
    )
    background_rgb: Annotated[tuple[Channel, Channel, Channel], Shown(("R", "G", "B"))] = _like(
        RenderConfig, "background_rgb", "colour where nothing is hit, 0 - 255 each"
    )
    _view: CameraConfig = PrivateAttr()

    @model_validator(mode="after")
    def _build_view(self) -> Self:
        self._view = self._camera_of({})
        return self

    def _camera_of(self, more: Mapping[str, Any]) -> CameraConfig:
        own = ("projection", "fisheye_k", "width", "height", "fov_deg")
        given = {name: getattr(self, name) for name in own if getattr(self, name) is not None}
        if isinstance(self.camera, CameraConfig):
            if given:
                raise ValueError(f"{next(iter(given))}: the camera has its own; leave one out")
            return self.camera.model_copy(update=dict(more))
        values = {("horizontal_fov_deg" if k == "fov_deg" else k): v for k, v in given.items()}
        if self.camera is not None:
            for name in ("projection", "fisheye_k", "fov_deg"):
                if name in given:
                    raise ValueError(
                        f"{name}: comes from the calibration; leave one of the two out"
                    )
            values["calibration"] = self.camera
        return _part(CameraConfig, {**values, **more})

    @property
    def view(self) -> CameraConfig:
        """The camera, its calibration read."""
        return self._view

    @property
    def render(self) -> RenderConfig:
        """Settings of drawing."""
        return _part(RenderConfig, self._drawing())

    def _drawing(self) -> dict[str, Any]:
        names = ("backend", "supersampling", "shade", "background_rgb")
        return {name: getattr(self, name) for name in names}


class CollectConfig(ViewConfig, PlaceConfig):
    """Settings of a data set of one mesh."""

    frames: int = Field(ge=1, le=MOST_FRAMES, description="number of training frames")
    test_frames: int = Field(0, ge=0, le=MOST_FRAMES, description="number of test frames")
    depth: bool = Field(False, description="write depth images too")
    depth_scale: Annotated[DepthUnitsPerM | None, Shown(("UNITS_PER_M",), "1000")] = Field(
        None,
        description="stored value of a depth of one metre; 1000 ends at 65.5 m, 100 at 655 m",
    )
    far_m: Annotated[Positive | None, Shown(("M",), "100")] = Field(
        None, description="farthest that cameras see, metres"
    )
    normals: bool = Field(False, description="write surface normals too (docs/layers.md)")
    masks: bool = Field(False, description="write masks of parts and objects too")
    seed: Seed = Field(0, description="seed of all random numbers")
    spacing_m: float = _like(CollectionConfig, "frame_spacing_m", "distance between frames, metres")
    roll_deg: Annotated[Interval, FROM_TO] = _like(
        Angles, "roll_deg", "bounds of the camera's roll, degrees"
    )
    pitch_deg: Annotated[Interval, FROM_TO] = _like(
        Angles, "pitch_deg", "bounds of its pitch, degrees; positive is down"
    )
    yaw_deg: Annotated[Interval, FROM_TO] = _like(
        Angles, "yaw_deg", "bounds of its heading, degrees; 0 is world x, 90 is y"
    )
    min_view_distance_m: NonNegative = _like(
        SceneConfig, "min_view_distance_m", "least free view at the end of a path, metres"
    )
    min_seen: Annotated[Fraction | None, Shown(("SHARE",), "0; 0.85 with `like`")] = Field(
        None, description="least share of the view that the mesh fills"
    )
    min_clearance_m: Annotated[NonNegative | None, Shown(("M",), "0; that of `stereo_m`")] = Field(
        None, description="least distance of cameras from surfaces, metres"
    )
    min_path_m: NonNegative = _like(
        CollectionConfig, "min_path_m", "least length of a path, metres; shorter ones are redrawn"
    )
    test_paths: Annotated[TestPaths | None, Shown(("N",), str(TEST_PATHS))] = Field(
        None, description="least number of paths among the test frames"
    )
    mode: Mode = _like(
        CollectionConfig,
        "mode",
        "straight paths, independent (random) poses, those of `poses`, or independent ones around"
        " these",
    )
    poses: Path | None = Field(
        None,
        description='with `mode="repeat"`: data set, 7-Scenes frames, pose table (.csv) or TUM'
        ' trajectory; with `mode="around"`: posed photographs, those of `like` if there are',
    )
    around_m: Annotated[Positive | None, Shown(("M",), f"{AROUND_M:g}")] = Field(
        None, description='with `mode="around"`: farthest from a photograph, metres'
    )
    around_turn_deg: Annotated[
        Annotated[float, Field(gt=0, le=180)] | None, Shown(("DEG",), f"{AROUND_DEG:g}")
    ] = Field(
        None,
        description='with `mode="around"`: farthest turn from it, degrees; a quarter of the frames'
        " look anywhere",
    )
    stereo_m: Annotated[StereoBaseline | None, Shown(("BASELINE_M",))] = Field(
        None, description="also render a second camera this far to the right, metres"
    )
    detail: Detail = _like(
        RenderConfig,
        "detail",
        "level of detail that colours are drawn with: by resolution, or the full mesh",
    )
    effects: EffectsConfig | None = Field(
        None, description="YAML: light, motion blur, exposure, noise and more (docs/variation.md)"
    )
    clutter: ClutterConfig | None = Field(
        None,
        description="YAML: objects to place in the scene, your own or cartons (docs/variation.md)",
    )
    sequence_frames: Count = Field(500, description="frames per sequence")
    archive: bool = Field(False, description="write each sequence as one seq-XX.zip")
    packed_px: Annotated[int, Field(ge=1)] | None = Field(
        None, description="write frames of PX x PX in one .npy too"
    )
    _parts: tuple[SceneConfig, CollectionConfig, RenderConfig] = PrivateAttr()

    @field_validator("effects", "clutter", mode="before")
    @classmethod
    def _read(cls, value: Any) -> Any:
        """Read a YAML file where one is named."""
        return read_yaml(Path(value)) if isinstance(value, str | Path) else value

    @model_validator(mode="after")
    def _build(self) -> Self:
        if self.depth_scale is not None and not self.depth:
            raise ValueError("depth_scale: is of depth images; give `depth=True`, too")
        more = {
            "stereo_baseline_m": self.stereo_m,
            "depth_units_per_m": self.depth_scale,
            "far_m": self.far_m,
        }
        more = {name: value for name, value in more.items() if value is not None}
        self._view = self._camera_of(more)
        clearance_m = self.min_clearance_m
        if clearance_m is None:
            clearance_m = self.stereo_m or 0.0  # so that no wall is between the two cameras
        angles = {name: getattr(self, name) for name in Angles.model_fields}
        scene = self._scene(
            angles=_part(Angles, angles),
            min_view_distance_m=self.min_view_distance_m,
            min_seen=self.min_seen,
            min_clearance_m=clearance_m,
            clutter=self.clutter,
        )
        movement = _part(
            CollectionConfig,
            {
                "mode": self.mode,
                "repeat": self.poses,
                "around_m": self.around_m,
                "around_turn_deg": self.around_turn_deg,
                "frame_spacing_m": self.spacing_m,
                "min_path_m": self.min_path_m,
                "test_paths": TEST_PATHS if self.test_paths is None else self.test_paths,
                "collision_agreement": None,
            },
        )
        drawing = {**self._drawing(), "detail": self.detail, "effects": self.effects}
        self._parts = scene, movement, _part(RenderConfig, drawing)
        self._check()
        return self

    def _check(self) -> None:
        if self.test_paths is not None and self.test_paths > self.test_frames:
            raise ValueError(
                f"test_paths: {self.test_frames} test frames cannot be of {self.test_paths} paths;"
                " give fewer, or more test frames"
            )
        side_px = min(self.view.width, self.view.height)
        if self.packed_px is not None and self.packed_px >= side_px:
            raise ValueError(
                f"packed_px: must be less than both sides of the image, found {self.packed_px}"
            )
        try:
            refuse_effects(self.render, self.collection, self.view, [self.scene])
        except ValueError as error:
            key, dot, rest = str(error).partition(": ")
            raise ValueError(f"{KEYS.get(key, key)}{dot}{rest}") from error

    @property
    def scene(self) -> SceneConfig:
        """The mesh, and what is asked of poses in it."""
        return self._parts[0]

    @property
    def collection(self) -> CollectionConfig:
        """Settings of the camera's movement."""
        return self._parts[1]

    @property
    def render(self) -> RenderConfig:
        """Settings of drawing."""
        return self._parts[2]

    @property
    def counts(self) -> dict[Literal["train", "test"], int]:
        """Frames of each split."""
        return {"train": self.frames, "test": self.test_frames}

    def changed(self, **values: Any) -> Self:
        """Return these settings with others in their place."""
        given = {name: getattr(self, name) for name in self.model_fields_set}
        return checked(type(self), {**given, **values})


class LikeConfig(Strict):
    """A sequence of photographs whose camera, box and angles a collection takes over."""

    like: Path | None = Field(
        None,
        description="posed photographs whose camera, box and angles to take over; poses are"
        " independent (docs/scanning.md)",
    )
    like_range: Annotated[tuple[int, int] | None, Shown(("START", "STOP"), "all")] = Field(
        None, description="with `like`: first frame and one past the last"
    )
    margin_m: Annotated[Annotated[float, Field(ge=0, le=1000)] | None, Shown(("M",), "0.2")] = (
        Field(None, description="with `like`: metres added around the box")
    )
    angle_margin_deg: Annotated[
        Annotated[float, Field(ge=0, le=360)] | None, Shown(("DEG",), "10")
    ] = Field(None, description="with `like`: degrees added around the angles")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("like_range", "margin_m", "angle_margin_deg"):
            if self.like is None and getattr(self, name) is not None:
                raise ValueError(f"{name}: goes with a sequence to be like")
        if self.like_range and not 0 <= self.like_range[0] < self.like_range[1]:
            start, stop = self.like_range
            raise ValueError(f"like_range: {start} to {stop} holds no frame")
        return self


def checked(model: type[Model], values: Mapping[str, Any]) -> Model:
    """Build a model from settings, of which None stands for the default.

    Raises:
        InputError: One cannot be used, or is none of the model's.
    """
    given = {name: value for name, value in values.items() if value is not None}
    if unknown := sorted(set(given) - set(model.model_fields)):
        raise InputError(
            Argument(unknown[0]), f"no such option; there are {', '.join(model.model_fields)}"
        )
    try:
        return model.model_validate(given)
    except ValidationError as error:
        where, _, problem = describe(error).partition(": ")
        field, _, below = where.partition(".")
        raise InputError(Argument(field), ": ".join(filter(None, (below, problem)))) from error


def _part(model: type[Model], values: Mapping[str, Any], names: Mapping[str, str] = KEYS) -> Model:
    """Build a model of the stages; what is wrong with it is said of the field that it is of.

    Args:
        model: The model.
        values: Its values.
        names: Names of fields by its keys, where they differ.

    Raises:
        ValueError: The values contradict each other.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        key, dot, rest = describe(error).partition(".")
        if not key.isidentifier():
            key, dot, rest = describe(error).partition(": ")
        raise ValueError(f"{names.get(key, key)}{dot}{rest}") from error
