"""Typed configuration of the profile ``real`` (``config/real.yaml``)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from baselines.config.learning import MODELS, ModelName
from synfeal.config.load import describe
from synfeal.config.types import Count, Strict, part
from synfeal.errors import InputError

Direction = Literal["official", "forward", "reverse", "alternate"]
Training = Literal["photographs", "rendered", "randomised", "both"]
# `refined`: poses in the map of rendered frames, found again on the scan drawn from them.
MapOf = Literal["rendered", "refined", "photographs"]


class Tried(Strict):
    """Rows, localizers and maps tried on the photographs of one direction."""

    trained_on: tuple[Training, ...] = Field((), description="rows of the table")
    localizers: tuple[ModelName, ...] = Field((), description="that are trained for each row")
    maps: tuple[MapOf, ...] = Field((), description="what maps for localization by structure show")


MAIN = Tried(
    trained_on=("photographs", "rendered", "randomised", "both"),
    localizers=MODELS,
    maps=("rendered", "refined", "photographs"),
)
CHECK = Tried(
    trained_on=("photographs", "randomised"), localizers=("posenet2",), maps=("rendered",)
)


class RealConfig(Strict):
    """A scene of 7-Scenes, and what is tried on it."""

    sequence: Path = Field(description="folder of a 7-Scenes scene, or of one of its sequences")
    sequence_name: str = Field(
        "seq-01", description="what labels call the sequence, where `sequence` is one, flat"
    )
    scene: str = Field("redkitchen", description="its name, for tables")
    results: Path = Field(Path("results/real"), description="folder that all is written to")
    sfm_labels: tuple[Path, ...] = Field(
        (), description="other labels of the same photographs (pseudo ground truth by SfM)"
    )
    depth_from_color: tuple[float, float, float, float, float, float] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        description="rotation vector, degrees, and translation, metres, from the colour camera to"
        " the depth camera: the given labels are of the latter, those by SfM of the former",
    )
    cameras: str = Field("--preset 7scenes", description="options of `synfeal scan`")
    map_cameras: str = Field("--preset 7scenes", description="options of `synfeal map`")
    scan: str = Field("", description="further options of `synfeal scan`")
    collect: str = Field("", description="further options of `synfeal collect`")
    like: Literal["all", "scanned"] = Field(
        "all",
        description="whose box and headings rendered cameras get: those of all photographs, as"
        " where somebody says where photographs will be taken, or of the scanned ones alone",
    )
    width: Count = Field(320, description="of rendered frames, pixels")
    height: Count = Field(240, description="of rendered frames, pixels")
    frames: Count = Field(3000, description="rendered frames of a scan")
    images: Count = Field(30_000, description="images shown to a localizer")
    map_frames: Count = Field(750, description="frames of a map")
    seeds: Count = Field(3, description="runs for each row and localizer")
    only_there: bool = Field(
        False, description="make tables of those runs alone whose poses are there; train nothing"
    )
    block_frames: Count = Field(
        50, description="neighbouring test photographs that limits are drawn by, together"
    )
    directions: dict[Direction, Tried] = part(
        lambda: {"official": MAIN, "forward": MAIN, "reverse": CHECK, "alternate": CHECK},
        "what is tried in each direction",
    )
    labels: Tried = part(
        lambda: Tried(trained_on=("randomised",), localizers=("posenet2",), maps=("rendered",)),
        "what is tried with the other labels, in the first direction",
    )
    curve_frames: tuple[Count, ...] = Field(
        (100, 300, 1000), description="fewer rendered frames, the first ones; one seed each"
    )
    curve_photographs: tuple[Count, ...] = Field(
        (50, 125, 500), description="photographs of other scans, all of them fused; one seed each"
    )
    curve_photographs_frames: Count = Field(1000, description="rendered frames of these scans")


def parse_real_config(values: Mapping[str, Any]) -> RealConfig:
    """Check a configuration.

    Raises:
        InputError: A key is missing, not known, or has a value that cannot be.
    """
    given = {key: value for key, value in values.items() if value not in (None, "")}
    if "sequence" not in given:
        raise InputError(
            "sequence",
            "missing",
            "say where the photographs are: make real SEVEN_SCENES=path (docs/real.md)",
        )
    directions = given.get("directions")
    if isinstance(directions, Mapping):
        given["directions"] = {name: tried for name, tried in directions.items() if tried}
    if isinstance(given.get("sfm_labels"), str):
        given["sfm_labels"] = given["sfm_labels"].split()
    try:
        return RealConfig.model_validate(given)
    except ValidationError as error:
        raise InputError("config/real.yaml", describe(error)) from error
