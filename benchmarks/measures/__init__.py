"""What benchmarks measure: a module each, loaded when asked for, as some libraries do not mix."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

from synfeal.config.models import Strict

MEASURES = ("effects", "kinect_fusion", "rgbd", "sfm", "training")


class Measure(NamedTuple):
    """``case`` is what a run is told; ``run(case, seed)`` gives the measured columns of its row."""

    case: type[Strict]
    run: Callable[[Any, int], dict[str, float]]


def open_measure(name: str) -> Measure:
    """``Case`` and ``run`` of the module of this name."""
    module = import_module(f"benchmarks.measures.{name}")
    return Measure(module.Case, module.run)
