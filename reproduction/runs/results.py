"""Reading of the result files of earlier stages."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from synfeal.errors import InputError, read_as, why
from synfeal.records.files import read_json

ADAPTER_OF = cache(TypeAdapter)  # by model or type


def read_text(path: Path) -> str:
    """Read the text of a result file."""
    with read_as(path, "text", remedy="; make it again"):
        return path.read_text(encoding="utf-8")


def read_result(path: Path, needed: Iterable[str], remedy: str, shape: Any = None) -> Any:
    """Read a JSON result file.

    Args:
        path: The file.
        needed: Keys it must have.
        remedy: What to do where it cannot be used, for messages.
        shape: Model or type to read it as; None for a mapping.

    Raises:
        InputError: the file is missing, is not JSON, is no mapping, lacks a key of ``needed`` or
            of the shape, or one is of another type; ``remedy`` says what to do.
    """
    with read_as(path, "JSON", remedy=f"; {remedy}"):
        value = read_json(path)
    if not isinstance(value, dict):
        raise InputError(path, "must hold a mapping of keys", remedy)
    absent = [key for key in needed if key not in value]
    if absent:
        raise InputError(path, f"{', '.join(absent)} missing", remedy)
    return value if shape is None else shaped(path, value, shape, remedy)


def shaped(path: Path, value: Any, shape: Any, remedy: str) -> Any:
    """Validate a result, or a part of one, as a model or type.

    Args:
        path: File it is from, for messages.
        value: The result as read from JSON.
        shape: Model or type that it must fit, without conversion.
        remedy: What to do where it does not, for messages.

    Returns:
        The result as that model or type.

    Raises:
        InputError: it does not fit; names the file and ``remedy``.
    """
    try:
        return ADAPTER_OF(shape).validate_json(json.dumps(value), strict=True)
    except ValidationError as error:
        raise InputError(path, why(error), remedy) from error


def unequal_leaves(a: Mapping[str, Any], b: Mapping[str, Any]) -> pd.DataFrame:
    """Tabulate the leaves in which two nested mappings differ.

    Columns are ``key``, dotted, in order; ``a`` and ``b``, values as JSON, NaN where one lacks it.
    """
    leaves = {}
    for name, whole in (("a", a), ("b", b)):
        [flat] = pd.json_normalize(dict(whole)).to_dict("records")
        leaves[name] = {key: json.dumps(value) for key, value in flat.items()}
    table = pd.DataFrame(leaves, dtype=object).sort_index()
    return table[table["a"].ne(table["b"])].rename_axis("key").reset_index()
