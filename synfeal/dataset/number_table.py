"""CSV files of numbers under a fixed header, written so that they read back exactly."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError, why
from synfeal.files import atomic_path


def write_numbers(path: Path, header: str, rows: Iterable[Sequence[float | str]]) -> None:
    """Write rows of Python numbers and names with enough digits to read back the same values."""
    lines = [",".join(map(str, row)) for row in rows]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")


def read_numbers(
    path: Path, header: str, kind: str, finite: bool = True, passed_over: str = ""
) -> NDArray[np.float64]:
    """Values (N, columns of ``header``) of a file, whose ``kind`` messages name.

    It may have a further, last column of names, which is ``passed_over``.

    Raises:
        InputError: the file is missing, has another header, or holds anything but numbers; with
            ``finite``, anything but finite ones.
    """
    n_columns = header.count(",") + 1
    try:
        found, *lines = path.read_text(encoding="utf-8").splitlines() or [""]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a {kind} ({why(error)})") from None
    if passed_over and found == f"{header},{passed_over}":
        found, lines = header, [line.rpartition(",")[0] for line in lines]
    if found != header:
        raise InputError(f"{path}: header must be '{header}', found '{found[:80]}'")
    try:
        values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
        values = values.reshape(len(lines), n_columns)
    except ValueError as error:
        raise InputError(f"{path}: {why(error)}; every row needs {n_columns} numbers") from None
    if finite and not np.isfinite(values).all():
        bad = int(np.argmin(np.isfinite(values).all(axis=1)))
        raise InputError(f"{path}: row {bad + 2} holds a value that is not finite")
    return values
