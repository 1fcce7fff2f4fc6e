"""Measures by name; a module is loaded when asked for, because not all libraries mix."""

from __future__ import annotations

from collections.abc import Callable
from pkgutil import resolve_name
from typing import Any, NamedTuple, get_type_hints

from synfeal.config.types import Strict

# Place of the function, ``module:name``, that measures a case, whose type its annotation is.
MEASURES = {
    "effects": "effects:run",
    "kinect_fusion": "labels:run_kinect_fusion",
    "rgbd": "labels:run_rgbd",
    "sfm": "labels:run_sfm",
    "training": "training:run",
}


class Measure(NamedTuple):
    """``case`` is what a run is told; ``run(case, seed)`` gives the measured columns of its row."""

    case: type[Strict]
    run: Callable[[Any, int], dict[str, float]]


def open_measure(name: str) -> Measure:
    """Return the measure of this name."""
    run = resolve_name(f"benchmarks.measures.{MEASURES[name]}")
    return Measure(get_type_hints(run)["case"], run)
