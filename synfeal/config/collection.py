"""Typed configuration of collection: scenes, and the movement of the camera."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from synfeal.config.types import (
    Fraction,
    Interval,
    NonNegative,
    Positive,
    Seed,
    Strict,
    ordered,
    part,
)
from synfeal.geometry.limits import FARTHEST_M


class Box(Strict):
    """An axis-aligned box in the world, metres."""

    x: Interval = Field(description="bounds, metres")
    y: Interval = Field(description="bounds, metres")
    z: Interval = Field(description="bounds, metres")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("x", "y", "z"):
            if max(map(abs, getattr(self, name))) > FARTHEST_M:
                raise ValueError(f"{name}: must lie within {FARTHEST_M:g} m of the origin")
        return self


class Angles(Strict):
    """Admissible angles of the camera, degrees."""

    roll_deg: Interval = Field((-29.8, 29.8), description="bounds, degrees")
    pitch_deg: Interval = Field((-29.8, 29.8), description="bounds, degrees")
    yaw_deg: Interval = Field((0.0, 360.0), description="bounds, degrees")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not -90 < self.pitch_deg[0] < self.pitch_deg[1] < 90:
            raise ValueError("pitch_deg: must lie within -90 and 90, where yaw and roll differ")
        for name in ("roll_deg", "yaw_deg"):
            low, high = getattr(self, name)
            if low < -360 or high > 720 or high - low > 360:
                raise ValueError(f"{name}: must span at most a full turn, within -360 and 720")
        return self


class ClutterConfig(Strict):
    """Objects that stand about, on the floor or on tables, wherever cameras can be above them."""

    count: int = Field(10, ge=1, le=1000, description="how many")
    files: tuple[Path, ...] = Field((), description="meshes in metres, used in turn; none: cartons")
    size_m: Annotated[tuple[Positive, Positive], AfterValidator(ordered)] = Field(
        (0.12, 0.4), description="cartons: shortest and longest side, metres"
    )
    seed: Seed = Field(0, description="of the layout")


# Packages that build scenes from a seed register them here (docs/adding.md): an entry point has the
# name of its builder and points to a function from that name and a seed to a textured mesh.
BUILDERS = "synfeal.scene_builders"


def installed_builder(name: str) -> str:
    """Check that an installed package builds scenes of this name."""
    known = sorted(entry_points(group=BUILDERS).names)
    if name not in known:
        raise PydanticCustomError(
            "builder",
            "must be a builder that is installed: {known}",
            {"known": ", ".join(known) or "there is none"},
        )
    return name


UpAxis = Literal["auto", "y", "z"]


class SceneConfig(Strict):
    """One scene: where its mesh comes from and where the camera may go."""

    unless_none = ("clutter", "min_seen")

    source: Literal["procedural", "mesh"] = Field(description="a stand-in, or a file")
    builder: Annotated[str, AfterValidator(installed_builder)] | None = Field(
        None, description="procedural: which stand-in, by the name it was registered with"
    )
    seed: Seed | None = Field(None, description="procedural: in place of the profile's seed")
    path: Path | None = Field(None, description="mesh: the file (.glb, .gltf, .obj, .ply)")
    sha256: str | None = Field(None, pattern=r"^[0-9a-f]{64}$", description="mesh: the file's hash")
    up_axis: UpAxis = Field(
        "auto", description="mesh: axis that points up; `auto`: y for glTF, else z"
    )
    unit_m: float = Field(1.0, ge=1e-6, le=1e6, description="mesh: one unit of the file, metres")
    sampling_box: Box | None = Field(None, description="bounds of camera centres; null: the mesh's")
    further_boxes: tuple[Box, ...] = Field(
        (), description="other rooms or floors, each with paths of its own; frames by volume"
    )
    angles: Angles = part(Angles, "bounds of the camera's angles")
    min_view_distance_m: NonNegative = Field(
        1.2, description="least free distance ahead of a target pose (the paper's d)"
    )
    min_seen: Fraction | None = Field(
        None,
        description="least share of the view, 50 x 40 degrees, of a pose that meets the mesh: scans"
        " end where nobody looked",
    )
    min_clearance_m: NonNegative = Field(
        0.0, description="least distance of every camera from any surface; 0: the paper asks none"
    )
    clutter: ClutterConfig | None = Field(None, description="objects that stand about")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.source == "procedural" and self.builder is None:
            raise ValueError("builder: a scene with `source: procedural` needs the name of one")
        if self.source == "mesh" and self.path is None:
            raise ValueError("path: a scene with `source: mesh` needs the path of its mesh file")
        if self.further_boxes and self.sampling_box is None:
            raise ValueError("further_boxes: come after a first one; give sampling_box")
        return self


Mode = Literal["path", "random", "repeat", "around"]
# Modes whose frames are no path, and are therefore still.
INDEPENDENT: tuple[Mode, ...] = ("random", "around")
# Farthest from a photograph in mode `around`: within an arm's reach, and at angles from which
# features are still recognised.
AROUND_M, AROUND_DEG = 0.5, 20.0
TestPaths = Annotated[int, Field(ge=1, le=10**6)]


class CollectionConfig(Strict):
    """Movement of the camera (section 3 of the paper)."""

    unless_none = ("test_paths", "around_m", "around_turn_deg")

    mode: Mode = Field(
        "path",
        description="`path`: the paper's; `random`: independent poses; `repeat`: those of another"
        " data set; `around`: independent poses near those of photographs",
    )
    repeat: Path | None = Field(
        None,
        description="mode `repeat`: data set, directory of 7-Scenes frames, pose table (.csv) or"
        " TUM trajectory (.txt); mode `around`: posed photographs, as of a scan",
    )
    around_m: Positive | None = Field(
        None,
        description="mode `around`: farthest that a camera is from the photograph that it is placed"
        f" by, metres; null: {AROUND_M}",
    )
    around_turn_deg: Annotated[float, Field(gt=0, le=180)] | None = Field(
        None,
        description="mode `around`: farthest that it is turned from it, degrees, but for a quarter"
        f" of the frames, which look anywhere; null: {AROUND_DEG:g}",
    )
    candidates: int = Field(8, ge=1, le=10**4, description="targets tried per path (the paper's k)")
    frame_spacing_m: float = Field(
        0.03, ge=1e-4, le=1e4, description="distance between frames (the paper's other d)"
    )
    min_path_m: NonNegative = Field(1.5, description="shorter paths are drawn again")
    test_paths: TestPaths | None = Field(
        None,
        description="mode `path`: least number of paths that the largest test set is of, every k-th"
        " frame of whole ones; a smaller set has the first of them; null: all frames of each path,"
        " as in the paper, so that few frames show one or two paths",
    )
    max_tries: int = Field(2000, ge=1, le=10**6, description="rounds until a scene is too narrow")
    interpolation: Literal["rpy", "slerp"] = Field(
        "rpy", description="`rpy`: the paper's, angle by angle, each the short way"
    )
    collision_agreement: Annotated[float, Field(gt=0.5, le=1)] | None = Field(
        0.995,
        description="share of 10,000 planner decisions in which the decimated collision mesh must"
        " agree with the full mesh; null: no decimation",
    )

    @model_validator(mode="before")
    @classmethod
    def _reach_of_around(cls, values: Any) -> Any:
        """Write down how far mode ``around`` goes, which other modes leave empty."""
        if not isinstance(values, dict) or values.get("mode") != "around":
            return values
        usual = {"around_m": AROUND_M, "around_turn_deg": AROUND_DEG}
        return values | {k: v for k, v in usual.items() if values.get(k) is None}

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.mode == "repeat" and self.repeat is None:
            raise ValueError("repeat: mode `repeat` needs the poses to repeat")
        if self.mode == "around" and self.repeat is None:
            raise ValueError("repeat: mode `around` needs posed photographs")
        if self.mode not in ("repeat", "around") and self.repeat is not None:
            raise ValueError(f"repeat: mode `{self.mode}` repeats nothing; leave it out")
        for name in ("around_m", "around_turn_deg"):
            if self.mode != "around" and getattr(self, name) is not None:
                raise ValueError(f"{name}: goes with mode `around`")
        return self
