"""Lines of numbers, millions at once: those of one form go through pandas together.

Every job that loads a mesh imports this module, and few of them read text: pandas, which takes half
a second to import, is imported where it is used.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

OF_NUMBERS = b"0123456789+-.eE"
SHOWN = 60  # characters of a line that a message quotes


def lines_by_form(block: bytes) -> Iterator[tuple[Ints, bytes]]:
    """Group lines that differ in their digits only.

    Args:
        block: Lines, each with a newline at its end.

    Yields:
        The positions (N,) of lines of one form, ascending, and the lines.
    """
    if not block:
        return
    forms = block.translate(None, OF_NUMBERS)
    count = forms.count(b"\n")
    first = forms[: forms.find(b"\n") + 1]
    if forms == first * count:
        yield np.arange(count), block
        return
    import pandas as pd

    lines = block.split(b"\n")[:-1]
    form_of, distinct = pd.factorize(np.array(forms.split(b"\n")[:-1], object))
    order = np.argsort(form_of, kind="stable")
    ends = np.cumsum(np.bincount(form_of, minlength=len(distinct)))
    for group in np.split(order, ends[:-1]):
        yield group.astype(np.int64), b"".join(lines[index] + b"\n" for index in group)


def table_of(block: bytes, n_columns: int, dtype: type) -> NDArray[Any]:
    """Read lines of equally many numbers as an array (N, ``n_columns``).

    Raises:
        ValueError: A line holds something else.
    """
    import pandas as pd

    try:
        found = pd.read_csv(
            io.BytesIO(block),
            sep=r"\s+",
            header=None,
            names=range(n_columns),
            index_col=False,
            dtype=dtype,
            quoting=csv.QUOTE_NONE,
            encoding="latin-1",
            skip_blank_lines=False,
            low_memory=False,
        )
    except (ValueError, OverflowError) as error:
        raise _blamed(block, n_columns, dtype) from error
    return found.to_numpy(dtype)


def _blamed(block: bytes, n_columns: int, dtype: type) -> ValueError:
    """Build the error that quotes the first line of a block that :func:`table_of` cannot read.

    Args:
        block: Lines, of which pandas refused one.
        n_columns: Numbers that each should have.
        dtype: ``np.float64`` or ``np.int64``. As floats, ``nan`` and ``inf`` are read, so whoever
            has the table looks for them; as whole numbers they are blamed here.
    """
    kind = float if dtype is np.float64 else int
    for line in block.split(b"\n")[:-1]:
        words = line.replace(b"\t", b" ").split(b" ")  # as pandas does; not at form feeds
        words = [word for word in words if word]
        if len(words) != n_columns:
            return ValueError(f"'{shown(line)}' should have {n_columns} numbers")
        for word in words:
            try:
                value = kind(word)
                is_number = b"_" not in word  # which Python allows between digits
            except ValueError:
                is_number = False
            if not is_number:
                hint = "; write decimals with a point" if b"," in word else ""
                noun = "number" if kind is float else "whole number"
                return ValueError(f"'{shown(word)}' in '{shown(line)}' is no {noun}{hint}")
            if kind is int and abs(value) > np.iinfo(dtype).max:
                return ValueError(f"'{shown(word)}' in '{shown(line)}' is too large")
    return ValueError("one of its lines does not hold numbers")


def shown(text: bytes) -> str:
    """Return text as a message quotes it."""
    word = decoded(text.strip())
    return word if len(word) <= SHOWN else f"{word[:SHOWN]} ..."


def decoded(text: bytes) -> str:
    """Decode a name: UTF-8, else what Windows writes in the west."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("cp1252", errors="replace")
