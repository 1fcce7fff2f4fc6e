"""Tables as files: every CSV with a header is read, checked and written here.

A schema says what the cells of each column hold, in the order of the file::

    SCHEMA = {"scene": TEXT, "frames": COUNT, "position_m_median": NUMBER}

A column more is a line more. In memory a table is a :class:`pandas.DataFrame` of those columns,
whose types the schema fixes; pandas is imported by what needs one, for it takes half a second.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError, read_as, why
from synfeal.records.files import atomic_path

if TYPE_CHECKING:
    import pandas as pd

REMEDY = "make that table again"


@dataclass(frozen=True)
class Kind:
    """Type of the cells of a column."""

    dtype: str  # of the column in memory
    optional: bool = False  # cells may be empty; in memory they are missing values
    expected: bool = True  # files must have the column; without it, all its cells are missing
    finite: bool = True


TEXT = Kind("str")
COUNT = Kind("int64")
NUMBER = Kind("float64")
LIMITLESS = Kind("float64", finite=False)  # may be infinite
MAYBE_COUNT = Kind("Int64", optional=True)
MAYBE = Kind("float64", optional=True)
MAYBE_TEXT = Kind("str", optional=True, expected=False)
EXTRA = Kind("float64", optional=True, expected=False)
EXTRA_TEXT = Kind("str", expected=False)
Schema = Mapping[str, Kind]


def read_frame(path: Path, schema: Schema, remedy: str = REMEDY, sep: str = ",") -> pd.DataFrame:
    """Read the columns of a schema, in its order, from a file, which may have others.

    Args:
        path: CSV file.
        schema: Kind of value by column.
        remedy: What to do where the file cannot be used, for messages.
        sep: Separator of its cells.

    Raises:
        InputError: the file is missing or no CSV, lacks a column, has a row of another length, or a
            cell does not hold what its column does.
    """
    import pandas as pd

    needed = [name for name, kind in schema.items() if kind.expected]
    records = read_records(path, needed, remedy, sep)
    columns: dict[str, Any] = {}
    for name, kind in schema.items():
        cells = [row.get(name, "") for _, row in records]
        values = [_value(cell, kind) for cell in cells]
        bad = next((i for i, value in enumerate(values) if value is _BAD), None)
        if bad is not None:
            expected = "a whole number" if kind.dtype.lower() == "int64" else "a number"
            where = f"{path}: row {records[bad][0]}: {name}"
            raise InputError(f"{where} must be {expected}, found '{cells[bad][:40]}'; {remedy}")
        columns[name] = pd.Series(values, dtype=kind.dtype)
    return pd.DataFrame(columns)


def read_records(
    path: Path, needed: Iterable[str] = (), remedy: str = REMEDY, sep: str = ","
) -> list[tuple[int, dict[str, str]]]:
    """Read the rows of a file, each with its line number: cells by column, as text.

    See :func:`read_frame`.
    """
    with (
        read_as(path, "CSV", OSError, UnicodeDecodeError, csv.Error, remedy=f"; {remedy}"),
        path.open(encoding="utf-8-sig", newline="") as file,  # spreadsheets add a mark
    ):
        reader = csv.reader(file, strict=True, delimiter=sep)
        header = next(reader, [])
        rows = [(reader.line_num, row) for row in reader if row]
    absent = [name for name in needed if name not in header]
    if absent:
        raise InputError(f"{path}: column {', '.join(absent)} missing; {remedy}")
    for line, row in rows:
        if len(row) != len(header):
            found = f"has {len(row)} cells where the header has {len(header)}"
            raise InputError(f"{path}: row {line}: {found}; {remedy}")
    return [(line, dict(zip(header, row, strict=True))) for line, row in rows]


def frame_of(records: Iterable[Mapping[str, Any]], schema: Schema) -> pd.DataFrame:
    """Build a frame with the columns and types of a schema; what a row lacks is missing."""
    import pandas as pd

    frame = pd.DataFrame.from_records(
        [{name: record.get(name) for name in schema} for record in records], columns=list(schema)
    )
    return frame.astype({name: kind.dtype for name, kind in schema.items()})


def records_of(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a frame as mappings by column."""
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


def rows_of(frame: pd.DataFrame) -> list[Any]:
    """Return the rows of a frame as named tuples, ``Index`` first."""
    return list(frame.itertuples())


def write_frame(
    path: Path, frame: pd.DataFrame, float_format: str | None = "%.6g", na_rep: str = ""
) -> None:
    """Write a frame: floats with six significant digits, or all of them with None."""
    with atomic_path(path) as temporary:
        frame.to_csv(
            temporary,
            index=False,
            float_format=float_format,
            na_rep=na_rep,
            lineterminator="\n",
            errors="surrogateescape",  # paths are bytes that need not be UTF-8
        )


_BAD = object()
_EMPTY: Sequence[str] = ("", "-", "NA")  # Snakemake's for what a job was too short to measure


def _value(cell: str, kind: Kind) -> object:
    """Convert a cell to the kind of its column; ``_BAD`` where that fails."""
    if kind.dtype == "str":
        return cell
    if kind.optional and cell in _EMPTY:
        return None
    try:
        number = float(cell)
    except ValueError:
        return _BAD
    if math.isnan(number) or (kind.finite and math.isinf(number)):
        return _BAD
    if kind.dtype == "float64":
        return number
    return int(number) if number.is_integer() and abs(number) < 2**53 else _BAD


def write_numbers(path: Path, header: str, rows: Iterable[Sequence[float | str]]) -> None:
    """Write rows of Python numbers and names with enough digits to read back the same values."""
    lines = [",".join(map(str, row)) for row in rows]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")


def read_numbers(
    path: Path,
    header: str,
    kind: str,
    finite: bool = True,
    passed_over: str = "",
    optional: str = "",
) -> NDArray[np.float64]:
    """Read a table of numbers.

    Args:
        path: CSV file.
        header: Header it must have; columns separated by commas.
        kind: What messages call the file.
        finite: Refuse values that are not finite.
        passed_over: Name of a last column of text that may follow, and is left out.
        optional: Name of one more column of numbers that may follow those of ``header``.

    Returns:
        Values (N, columns); with one column more where ``optional`` is there.

    Raises:
        InputError: the file holds anything else.
    """
    with read_as(path, f"a {kind}"):
        found, *lines = path.read_text(encoding="utf-8").splitlines() or [""]
    if optional and f"{found},".startswith(f"{header},{optional},"):
        header = f"{header},{optional}"
    n_columns = header.count(",") + 1
    if passed_over and found == f"{header},{passed_over}":
        found, lines = header, [line.rpartition(",")[0] for line in lines]
    if found != header:
        raise InputError(f"{path}: header must be '{header}', found '{found[:80]}'")
    try:
        values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
        values = values.reshape(len(lines), n_columns)
    except ValueError as error:
        raise InputError(f"{path}: {why(error)}; every row needs {n_columns} numbers") from error
    if finite and not np.isfinite(values).all():
        bad = int(np.argmin(np.isfinite(values).all(axis=1)))
        raise InputError(f"{path}: row {bad + 2} holds a value that is not finite")
    return values
