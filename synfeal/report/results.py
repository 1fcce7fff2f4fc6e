"""Reading the files that the stages before the report leave behind."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from synfeal.errors import InputError, why
from synfeal.files import read_json


def read_text(path: Path) -> str:
    """The text of a result file.

    Raises:
        InputError: it is missing or cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: missing; make the results first") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({why(error)}); make it again") from None


def read_result(path: Path, needed: Iterable[str], remedy: str) -> dict[str, Any]:
    """A mapping from a result file.

    Args:
        path: the file.
        needed: keys it must have.
        remedy: what to do when it cannot be used, e.g. ``score that run again``.

    Raises:
        InputError: the file is missing, is not JSON, is no mapping, or lacks a key.
    """
    try:
        value = read_json(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as JSON ({why(error)}); {remedy}") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: must hold a mapping of keys; {remedy}")
    absent = [key for key in needed if key not in value]
    if absent:
        raise InputError(f"{path}: {', '.join(absent)} missing; {remedy}")
    return value


def check_result(path: Path, value: Any, shape: TypeAdapter[Any], remedy: str) -> None:
    """Check that what a result file holds, or a part of it, has the shape it is read as.

    Raises:
        InputError: naming the first key that is missing or of another type.
    """
    try:
        shape.validate_json(json.dumps(value), strict=True)
    except ValidationError as error:
        raise InputError(f"{path}: {why(error)}; {remedy}") from None
