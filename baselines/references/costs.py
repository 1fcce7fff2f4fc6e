"""Processor seconds that a test frame takes before a method can answer for it.

Descriptors, features and matches are found once and serve all label sets and several methods. Who
asks for one pose has to wait for all of them, so they are part of what an answer takes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from synfeal.errors import InputError, read_as
from synfeal.records.files import read_json, write_json

REMEDY = "; make it again"


def write_costs(path: Path | None, seconds: Mapping[str, float], frames: int) -> None:
    """Write seconds per frame by the name of the work; nothing without a path.

    Args:
        path: JSON to write.
        seconds: Processor seconds that all frames took, by the name of the work.
        frames: Number of frames.
    """
    if path is not None:
        write_json(path, {name: spent / max(frames, 1) for name, spent in seconds.items()})


def read_costs(paths: Iterable[Path]) -> dict[str, float]:
    """Read what :func:`write_costs` wrote to some files.

    Raises:
        InputError: a file cannot be read, or holds anything but numbers.
    """
    costs: dict[str, float] = {}
    for path in paths:
        with read_as(path, "JSON", remedy=REMEDY):
            found = read_json(path)
        if not isinstance(found, dict) or not all(isinstance(s, float) for s in found.values()):
            raise InputError(path, f"must hold seconds by name{REMEDY}")
        costs |= found
    return costs
