"""Tables as files: every CSV with a header is read, checked and written here.

A schema says what the cells of each column hold, in the order of the file::

    SCHEMA = {"scene": TEXT, "frames": COUNT, "position_m_median": NUMBER}

A column more is a line more. In memory a table is a :class:`pandas.DataFrame` of those columns,
whose types the schema fixes; pandas is imported by what needs one, for it takes half a second.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError, read_as
from synfeal.records.files import atomic_path, read_text

if TYPE_CHECKING:
    import pandas as pd

REMEDY = "make that table again"


@dataclass(frozen=True)
class Kind:
    """Type of the cells of a column."""

    dtype: str  # type of the column in memory
    optional: bool = False  # cells may be empty or "nan"; in memory they are missing values
    expected: bool = True  # files must have the column; without it, all its cells are missing
    finite: bool = True


TEXT = Kind("str")
COUNT = Kind("int64")
NUMBER = Kind("float64")
LIMITLESS = Kind("float64", finite=False)  # may be infinite
MAYBE_COUNT = Kind("Int64", optional=True)
MAYBE = Kind("float64", optional=True)
LIMITLESS_MAYBE = Kind("float64", optional=True, finite=False)
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
    """Read the rows of a file as text.

    Args:
        path: CSV file.
        needed: Columns it must have.
        remedy: What to do where the file cannot be used, for messages.
        sep: Separator of its cells.

    Returns:
        Line number of each row, 1 for the header's, and its cells by column.

    Raises:
        InputError: The file is missing or no CSV, lacks a column, has one twice, or has a row of
            another length.
    """
    with read_as(path, "CSV", OSError, UnicodeDecodeError, remedy=f"; {remedy}"):
        text = read_text(path, "utf-8-sig")  # spreadsheets add a mark
    table = parse_cells(path, text, remedy=remedy, sep=sep)
    absent = [name for name in needed if name not in table.header]
    if absent:
        found = f"; its columns are {', '.join(table.header)[:200]}" if table.header else ""
        raise InputError(path, f"column {', '.join(absent)} missing{found}", remedy)
    table.check_rows()
    rows = zip(table.lines, table.rows, strict=True)
    return [(line, dict(zip(table.header, row, strict=True))) for line, row in rows]


@dataclass(frozen=True)
class Cells:
    """Text of a CSV, cell by cell.

    Attributes:
        path: File, for messages.
        header: Names of the columns; none in an empty file.
        lines: Line of each row; that of the header is 1.
        rows: Cells of each row.
        remedy: What to do about a bad row, for messages.
    """

    path: Path
    header: tuple[str, ...]
    lines: Sequence[int]
    rows: Sequence[list[str]]
    remedy: str

    def check_rows(self) -> None:
        """Refuse two columns of one name, and rows longer or shorter than the header.

        Raises:
            InputError: There is such a column or row.
        """
        twice = [name for i, name in enumerate(self.header) if name in self.header[:i]]
        if twice:
            raise InputError(self.path, f"column {twice[0]} appears twice", self.remedy)
        for line, row in zip(self.lines, self.rows, strict=True):
            if len(row) != len(self.header):
                found = f"has {len(row)} cells where the header has {len(self.header)}"
                raise InputError(self.path, f"row {line}: {found}", self.remedy)

    def numbers(self, names: Sequence[str], may_be_empty: bool = False) -> NDArray[np.float64]:
        """Return the values (N, C) of some columns.

        Args:
            names: Columns of the header.
            may_be_empty: Read empty cells as not a number.

        Returns:
            What the cells hold, which may be infinite or not a number.

        Raises:
            InputError: A cell holds no number.
        """
        places = [self.header.index(name) for name in names]
        empty = "nan" if may_be_empty else ""
        cells = self.rows
        if may_be_empty or places != list(range(len(self.header))):
            cells = [[row[place] or empty for place in places] for row in self.rows]
        try:
            return np.array(cells, np.float64).reshape(len(cells), len(places))
        except ValueError as error:
            for line, row in zip(self.lines, cells, strict=True):
                for name, cell in zip(names, row, strict=True):
                    if not is_number(cell):
                        where = f"{self.path}: row {line}: {name}"
                        found = f"must be a number, found '{cell[:40]}'"
                        raise InputError(f"{where} {found}; {self.remedy}") from error
            raise


def is_number(text: str) -> bool:
    """Tell whether Python reads a text as a number, which may be infinite or none ("nan")."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def parse_cells(
    path: Path,
    text: str,
    what: str = "CSV",
    remedy: str = REMEDY,
    sep: str = ",",
    skip_blank: bool = True,
) -> Cells:
    """Split the text of a CSV with a header into cells.

    Args:
        path: File of the text, for messages.
        text: What the file holds.
        what: What it should hold, with its article, for messages.
        remedy: What to do about a file that cannot be used, for messages.
        sep: Separator of cells.
        skip_blank: Leave out blank lines; otherwise each is a row without cells.

    Raises:
        InputError: A quoted cell does not end, or has more text after its end.
    """
    reader = csv.reader(io.StringIO(text, newline=""), strict=True, delimiter=sep)
    lines: list[int] = []
    rows: list[list[str]] = []
    with read_as(path, what, csv.Error, remedy=f"; {remedy}"):
        header = next(reader, [])
        for row in reader:
            if row or not skip_blank:
                lines.append(reader.line_num)
                rows.append(row)
    return Cells(path, tuple(header), lines, rows, remedy)


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
    """Write a frame as CSV, without its index.

    Args:
        path: File to write.
        frame: The table.
        float_format: Format of floats, ``%`` style; None for as many digits as tell them apart.
        na_rep: Text for missing values.
    """
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
    if not is_number(cell):
        return _BAD
    number = float(cell)
    if math.isnan(number):
        return None if kind.optional else _BAD
    if kind.finite and math.isinf(number):
        return _BAD
    if kind.dtype == "float64":
        return number
    return int(number) if number.is_integer() and abs(number) < 2**53 else _BAD


def write_numbers(path: Path, header: str, rows: Iterable[Sequence[float | str]]) -> None:
    """Write rows of Python numbers and names with enough digits to read back the same values.

    Args:
        path: CSV file to write.
        header: Its first line, columns separated by commas.
        rows: Cells of each row.
    """
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    with atomic_path(path) as temporary:
        temporary.write_text(f"{header}\n{text.getvalue()}", encoding="utf-8")


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """Write numbers (N,) by name, with enough digits to read back the same values.

    Args:
        path: CSV file to write.
        columns: Its columns; what is not a number is written as ``nan``.
    """
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    write_numbers(path, ",".join(columns), rows)


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
        InputError: The file cannot be read, has another header, a blank line, a row of another
            length, or a cell that holds no number.
    """
    with read_as(path, f"a {kind}"):
        text = read_text(path, "utf-8-sig")
    table = parse_cells(path, text, f"a {kind}", skip_blank=False)
    names = header.split(",")
    columns = [*names, optional] if optional and optional in table.header else names
    has_text = bool(passed_over) and table.header[-1:] == (passed_over,)
    if table.header != (*columns, *([passed_over] if has_text else [])):
        found = ",".join(table.header)
        raise InputError(path, f"header must be '{header}', found '{found[:80]}'")
    table.check_rows()
    values = table.numbers(columns)
    if finite and not np.isfinite(values).all():
        bad = int(np.argmin(np.isfinite(values).all(axis=1)))
        raise InputError(path, f"row {bad + 2} holds a value that is not finite")
    return values
