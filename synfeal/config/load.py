"""Reading configuration files; errors name file and key in one line."""

from __future__ import annotations

import reprlib
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from synfeal.errors import InputError, read_as, wording
from synfeal.records.files import MOST_YAML_BYTES, PlainLoader, read_text


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping from a file.

    Raises:
        InputError: The file cannot be read, or holds something else.
    """
    with read_as(path, "YAML", OSError, ValueError, RecursionError, yaml.YAMLError):
        text = read_text(path, most_bytes=MOST_YAML_BYTES)
        value = yaml.load(text, PlainLoader)  # noqa: S506 (a SafeLoader)
    if not isinstance(value, dict):
        found = "nothing" if value is None else _shortened(reprlib.repr(value))
        raise InputError(path, f"must hold a mapping of keys, found {found}")
    return value


def merge(base: Mapping[str, Any], override: Mapping[str, Any]) -> dict[str, Any]:
    """Merge mappings recursively; anything that is not a mapping is replaced whole."""
    merged = dict(base)
    for key, value in override.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = merge(merged[key], value) if both else value
    return merged


def describe(error: ValidationError) -> str:
    """Describe the first problem in a line: dotted key, what is wrong, found and allowed."""
    first = error.errors()[0]
    key = ".".join(str(part) or "''" for part in first["loc"] if "[" not in str(part))
    if first["type"] == "missing" and isinstance(first["loc"][-1], int):  # an element of a list
        key, _, place = key.rpartition(".")
        return f"{key}: must hold at least {int(place) + 1} values"
    if first["type"] == "missing":
        return f"{key}: missing; it has no default"
    message = wording(first)
    if first["type"] == "value_error":
        return f"{key}.{message}" if key else message
    more = len(error.errors()) - 1
    found = _shortened(reprlib.repr(first["input"]))
    where = f"{key}: " if key else ""
    return f"{where}{message}, found {found}" + (f" (and {more} more)" if more else "")


def _shortened(text: str, length: int = 60) -> str:
    return text if len(text) <= length else f"{text[:length]}..."


DOCUMENTATION = "config/scenes/README.md"


def check_mesh_file(path: Path, field: str) -> None:
    """Check that the mesh file named by a configuration key, ``field``, is there."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        missing = isinstance(error, FileNotFoundError | NotADirectoryError)
        why = "does not exist" if missing else f"cannot be read ({error.strerror})"
        raise InputError(
            field, f"{path} {why}", f"put the mesh there or change the path (see {DOCUMENTATION})"
        ) from error
    if not stat.S_ISREG(mode):
        kind = "a directory" if stat.S_ISDIR(mode) else "no plain file"
        raise InputError(field, f"{path} is {kind}", "name the mesh file itself")
