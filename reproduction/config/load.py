"""Reading profiles."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from reproduction.config.profile import Config
from synfeal.config.collection import SceneConfig
from synfeal.config.load import check_mesh_file, describe, merge, read_yaml
from synfeal.errors import InputError


def parse_config(raw: Mapping[str, Any], origin: str = "config") -> Config:
    """Check a configuration that was merged from files.

    Args:
        raw: Its keys and values.
        origin: Files it comes from, for messages.

    Raises:
        InputError: A key is wrong; the first one is named.
    """
    try:
        return Config.model_validate(dict(raw))
    except ValidationError as error:
        raise InputError(origin, describe(error)) from error


def load_config(*paths: Path) -> Config:
    """Read YAML files, later ones overriding earlier ones key by key, and check the result."""
    merged: dict[str, Any] = {}
    for path in paths:
        merged = merge(merged, read_yaml(path))
    return parse_config(merged, " + ".join(map(str, paths)))


def check_mesh_files(scenes: Mapping[str, SceneConfig]) -> None:
    """Check that the file of every scene with ``source: mesh`` is there."""
    for name, scene in scenes.items():
        if scene.source == "mesh" and scene.path is not None:
            check_mesh_file(scene.path, f"scenes.{name}.path")


def check_results(root: Path) -> None:
    """Check that results can lie in the directory ``root``, which need not exist."""
    try:
        place = next(path for path in (root, *root.parents) if os.path.lexists(path))
    except OSError as error:
        raise InputError(
            "results", f"{root}: {error.strerror}", "choose another directory"
        ) from error
    if not place.is_dir():
        raise InputError("results", f"{place} is not a directory", "choose another one")
