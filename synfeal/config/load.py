"""Reading configuration files: one line that names file and key when something is wrong."""

from __future__ import annotations

import os
import reprlib
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from synfeal.config.collection import SceneConfig
from synfeal.config.models import Config
from synfeal.errors import InputError, read_as
from synfeal.files import PlainLoader


def parse_config(raw: Mapping[str, Any], origin: str = "config") -> Config:
    """Check a merged mapping; an :class:`InputError` names ``origin`` and the first wrong key."""
    try:
        return Config.model_validate(dict(raw))
    except ValidationError as error:
        raise InputError(f"{origin}: {describe(error)}") from None


def load_config(*paths: Path) -> Config:
    """Read YAML files, later ones overriding earlier ones key by key, and check the result."""
    merged: dict[str, Any] = {}
    for path in paths:
        merged = merge(merged, read_yaml(path))
    return parse_config(merged, " + ".join(map(str, paths)))


def read_yaml(path: Path) -> dict[str, Any]:
    """A YAML mapping from a file."""
    with read_as(path, "YAML", OSError, ValueError, RecursionError, yaml.YAMLError):
        value = yaml.load(path.read_text(encoding="utf-8"), PlainLoader)  # noqa: S506 (a SafeLoader)
    if not isinstance(value, dict):
        found = "nothing" if value is None else _shortened(reprlib.repr(value))
        raise InputError(f"{path}: must hold a mapping of keys, found {found}")
    return value


def merge(base: Mapping[str, Any], override: Mapping[str, Any]) -> dict[str, Any]:
    """Merge mappings recursively; anything that is not a mapping is replaced whole."""
    merged = dict(base)
    for key, value in override.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = merge(merged[key], value) if both else value
    return merged


def describe(error: ValidationError) -> str:
    """The first problem in one line: dotted key, what is wrong, what was found, what is allowed."""
    first = error.errors()[0]
    key = ".".join(str(part) or "''" for part in first["loc"] if part != "[key]")
    if first["type"] == "missing":
        return f"{key}: missing; it has no default"
    own = {"path_type": "must be a path", "model_type": "must hold a mapping of keys"}
    message = own.get(first["type"], first["msg"].removeprefix("Value error, "))
    if first["type"] == "value_error":
        return f"{key}.{message}" if key else message
    more = len(error.errors()) - 1
    found = _shortened(reprlib.repr(first["input"]))
    where = f"{key}: " if key else ""
    return f"{where}{message}, found {found}" + (f" (and {more} more)" if more else "")


def _shortened(text: str, length: int = 60) -> str:
    return text if len(text) <= length else f"{text[:length]}..."


DOCUMENTATION = "config/scenes/README.md"


def check_mesh_files(scenes: Mapping[str, SceneConfig]) -> None:
    """Check that the file of every scene with ``source: mesh`` is there."""
    for name, scene in scenes.items():
        if scene.source == "mesh" and scene.path is not None:
            check_mesh_file(scene.path, f"scenes.{name}.path")


def check_mesh_file(path: Path, field: str) -> None:
    """Check that the mesh file named by a configuration key, ``field``, is there."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        missing = isinstance(error, FileNotFoundError | NotADirectoryError)
        why = "does not exist" if missing else f"cannot be read ({error.strerror})"
        raise InputError(
            f"{field}: {path} {why}; put the mesh there or change the path (see {DOCUMENTATION})"
        ) from None
    if not stat.S_ISREG(mode):
        kind = "a directory" if stat.S_ISDIR(mode) else "no plain file"
        raise InputError(f"{field}: {path} is {kind}; name the mesh file itself")


def check_results(root: Path) -> None:
    """Check that results can lie in the directory ``root``, which need not exist."""
    try:
        place = next(path for path in (root, *root.parents) if os.path.lexists(path))
    except OSError as error:
        raise InputError(f"results: {root}: {error.strerror}; choose another directory") from None
    if not place.is_dir():
        raise InputError(f"results: {place} is not a directory; choose another one")
