"""Demands of the design on the label methods."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from baselines.labels.methods import METHODS, SIMULATOR
from reproduction.config.profile import Config
from reproduction.design.experiments import INJECTED, Experiment
from synfeal.errors import InputError


def check_sources(rows: Sequence[Experiment], design: Path | str) -> None:
    """Refuse a design with labels that nothing makes.

    Raises:
        InputError: naming the design, the label source, and the sources there are.
    """
    known = (SIMULATOR, *INJECTED, *METHODS)
    for row in rows:
        if row.labels not in known:
            raise InputError(design, f"labels '{row.labels}': not one of {', '.join(known)}")


def estimation_parameters(config: Config, name: str) -> dict[str, Any]:
    """Return the part of a configuration that the labels of a method depend on, ready for JSON."""
    chained = {"batch_frames", "assist_position_m", "assist_orientation_deg"}
    method = METHODS[name]
    on_graph = method.works_on == "graph"
    settings = {"rgbd", "posegraph"} if on_graph else {method.settings or name}
    return {
        "estimation": config.estimation.model_dump(mode="json", include=chained | settings),
        "camera": config.estimation_camera.model_dump(mode="json"),
        "seed": config.seed,
    }
