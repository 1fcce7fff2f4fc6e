"""Reading the files that the stages before the report leave behind."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from synfeal.errors import InputError


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
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as JSON ({error}); {remedy}") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: must hold a mapping of keys; {remedy}")
    absent = [key for key in needed if key not in value]
    if absent:
        raise InputError(f"{path}: {', '.join(absent)} missing; {remedy}")
    return value


def read_table(path: Path, needed: Iterable[str] = ()) -> list[dict[str, str]]:
    """Rows of a CSV file by column.

    Raises:
        InputError: it cannot be read, or lacks a column of ``needed``.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file, restval="")
            rows = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            f"{path}: cannot be read as CSV ({error}); make that table again"
        ) from None
    absent = [column for column in needed if column not in (reader.fieldnames or ())]
    if absent:
        raise InputError(f"{path}: column {', '.join(absent)} missing; make that table again")
    return rows
