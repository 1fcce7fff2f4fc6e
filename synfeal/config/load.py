"""Reading configuration files: one line that names file and key when something is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

import yaml
from pydantic import ValidationError

from synfeal.config.models import Config
from synfeal.errors import InputError


def parse_config(raw: Mapping[str, Any], origin: str = "config") -> Config:
    """Check a merged mapping.

    Raises:
        InputError: naming ``origin``, the first offending key, and what is allowed there.
    """
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
    """A YAML mapping from a file.

    Raises:
        InputError: the file is missing, is not UTF-8, is not YAML, or is no mapping.
    """
    try:
        value = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{path}: cannot be read as YAML ({error})") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: must hold a mapping of keys, found {type(value).__name__}")
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
    key = ".".join(str(part) for part in first["loc"] if part != "[key]")
    if first["type"] == "extra_forbidden":
        return f"{key}: unknown key; allowed here: {', '.join(_siblings(first['loc']))}"
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "value_error":
        return f"{key}.{message}" if key else message
    more = len(error.errors()) - 1
    return f"{key}: {message}, found {first['input']!r}" + (f" (and {more} more)" if more else "")


def _siblings(location: tuple[int | str, ...]) -> list[str]:
    """Keys allowed beside the unknown one at ``location``."""
    model: Any = Config
    for part in location[:-1]:
        if isinstance(model, type) and part in getattr(model, "model_fields", {}):
            model = _model_in(model.model_fields[str(part)].annotation)
    return sorted(getattr(model, "model_fields", {}))


def _model_in(annotation: Any) -> Any:
    """The model class inside ``X``, ``X | None`` or ``dict[str, X]``."""
    if hasattr(annotation, "model_fields"):
        return annotation
    return next((m for m in map(_model_in, get_args(annotation)) if m is not None), None)
