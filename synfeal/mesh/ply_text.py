"""The elements of PLY files, of text or binary, whatever lists their rows hold.

After G. Turk, "The PLY Polygon File Format" (1994), with the names of types that came later.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.text_rows import lines_by_form, shown, table_of

Ints = NDArray[np.int64]
Values = NDArray[Any]

TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
TYPES |= {"float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2"}
TYPES |= {"uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}
TYPES |= {"int64": "i8", "uint64": "u8", "half": "f2", "float16": "f2", "longlong": "i8"}
BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
KEYWORDS = {"format", "element", "property"}
MOST_HEADER_BYTES = 1 << 20


@dataclass(frozen=True)
class Property:
    """A property of an element's rows: a number, or a list if ``count_type`` is set."""

    name: str
    kind: str  # numpy's, without byte order
    count_kind: str | None = None


@dataclass(frozen=True)
class Element:
    """An element as the header declares it."""

    name: str
    count: int
    properties: tuple[Property, ...]


@dataclass(frozen=True)
class Lists:
    """Lists of different lengths.

    Attributes:
        counts: Length (N,) of each list.
        values: Their values, list after list.
    """

    counts: Ints
    values: Values


@dataclass(frozen=True)
class PlyText:
    """Contents of a PLY file.

    Attributes:
        comments: What stands behind each ``comment`` and ``obj_info``.
        elements: Declarations in order.
        columns: By element and property, its numbers (N,) or lists.
    """

    comments: tuple[str, ...]
    elements: tuple[Element, ...]
    columns: dict[str, dict[str, Values | Lists]]
    n_left_over: int = 0  # bytes behind the last element

    def numbers(self, element: str, name: str) -> Values | None:
        """Return a column of numbers (N,), None if there is none of the name."""
        found = self.columns.get(element, {}).get(name)
        return None if isinstance(found, Lists) else found

    def lists(self, element: str, *names: str) -> Lists | None:
        """Return the first column of lists that has one of the names, None if none has."""
        columns = self.columns.get(element, {})
        found = (columns.get(name) for name in names)
        return next((column for column in found if isinstance(column, Lists)), None)


def parse_ply(content: bytes) -> PlyText:
    """Read a PLY file.

    Raises:
        ValueError: It is none, is cut short, or a row of it cannot be read.
    """
    order, comments, elements, body = _header(content)
    read = _read_text if order == "" else _read_binary
    columns: dict[str, dict[str, Values | Lists]] = {}
    for element in elements:
        found, body = read(element, body, order)
        columns[element.name] = found
    if order == "" and body.strip():
        raise ValueError(f"it has more rows than its header says, such as '{shown(body[:80])}'")
    return PlyText(tuple(comments), tuple(elements), columns, len(body.strip()))


def _header(content: bytes) -> tuple[str, list[str], list[Element], bytes]:
    """Read the header; return byte order, comments, elements and what follows."""
    start, order, comments, elements = 0, None, [], []
    text = content[:MOST_HEADER_BYTES]
    if text[:3] != b"ply" or text[3:4] not in (b"\n", b"\r"):
        raise ValueError("it does not begin with 'ply'")
    while True:
        ends = [place for mark in (b"\n", b"\r") if (place := text.find(mark, start)) >= 0]
        if not ends:
            raise ValueError("its header does not end")
        line, end = text[start : min(ends)], min(ends) + 1
        is_pair = text[end - 1 : end + 1] == b"\r\n"
        start = end + is_pair
        words = line.decode("latin-1").split()
        match words:
            case ["end_header", *_]:
                break
            case ["format", str(name), *_]:
                if name not in BYTE_ORDERS:
                    raise ValueError(f"its format '{shown(line)}' is not known")
                order = BYTE_ORDERS[name]
            case ["comment" | "obj_info", *_]:
                comments.append(line.decode("utf-8", errors="replace").partition(" ")[2].strip())
            case ["element", str(name), str(count)] if count.isdigit():
                elements.append(Element(name, int(count), ()))
            case ["property", *rest] if elements:
                last = elements[-1]
                properties = (*last.properties, _property(rest, line))
                elements[-1] = Element(last.name, last.count, properties)
            case [word, *_] if word not in KEYWORDS:  # a comment that somebody broke in two
                comments.append(" ".join(words))
            case []:
                pass
            case _:
                raise ValueError(f"its header has '{shown(line)}'")
    if order is None:
        raise ValueError("its header names no format")
    for names in ([e.name for e in elements], *([p.name for p in e.properties] for e in elements)):
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"its header declares '{name}' twice")
    return order, comments, elements, content[start:]


def _property(words: list[str], line: bytes) -> Property:
    match words:
        case ["list", str(count), str(kind), str(name)] if {count, kind} <= set(TYPES):
            if TYPES[count][0] != "f":
                return Property(name, TYPES[kind], TYPES[count])
        case [str(kind), str(name)] if kind in TYPES:
            return Property(name, TYPES[kind])
    raise ValueError(f"its header has '{shown(line)}'")


Columns = dict[str, "Values | Lists"]


def _read_text(element: Element, body: bytes, order: str) -> tuple[Columns, bytes]:
    """Read an element whose rows are lines; return its columns and what follows."""
    del order
    if not element.properties or not element.count:
        return _columns(element, []), body
    body = _clean(body)
    if body.count(b"\n") < element.count:
        held = body.count(b"\n")
        raise ValueError(
            f"it ends after {held} of {element.count} rows of '{element.name}'; download or export"
            " it again"
        )
    end = _end_of_line(body, element.count)
    groups: list[tuple[Ints, Values, tuple[int, ...]]] = []
    for rows, lines in lines_by_form(body[:end]):
        n_words = len(lines[: lines.find(b"\n")].split())
        table = table_of(lines, n_words, np.float64)
        groups += _layouts(element, rows, table)
    return _columns(element, [_split(element, *group) for group in groups]), body[end:]


def _clean(body: bytes) -> bytes:
    """Return lines without empty ones, each with a newline behind it."""
    if b"\r" in body:
        body = body.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\t" in body:
        body = body.replace(b"\t", b" ")
    if b"\n\n" in body or b"\n " in body or body[:1] in (b" ", b"\n"):
        body = b"\n".join(line for line in body.split(b"\n") if line.strip())
    return body if body.endswith(b"\n") or not body else body + b"\n"


def _end_of_line(body: bytes, count: int) -> int:
    """Return where the line behind the first ``count`` ones begins."""
    ends = np.flatnonzero(np.frombuffer(body, np.uint8) == ord("\n"))
    return int(ends[count - 1]) + 1


def _layouts(
    element: Element, rows: Ints, table: Values
) -> Iterator[tuple[Ints, Values, tuple[int, ...]]]:
    """Sort rows of equally many numbers by the lengths of their lists.

    Yields:
        Rows, their numbers, and the lengths of their lists.
    """
    # Rows, their numbers, the next property, its column, and lengths of the lists before it.
    pending: list[tuple[Ints, Values, int, int, tuple[int, ...]]] = [(rows, table, 0, 0, ())]
    while pending:
        rows, table, index, column, lengths = pending.pop()
        while index < len(element.properties) and element.properties[index].count_kind is None:
            index, column = index + 1, column + 1
        if index == len(element.properties):
            if column != table.shape[1]:
                raise ValueError(
                    f"a row of '{element.name}' has {table.shape[1]} numbers instead of {column}"
                )
            yield rows, table, lengths
            continue
        if column >= table.shape[1]:
            raise ValueError(f"a row of '{element.name}' is too short")
        for length in np.unique(table[:, column]):
            if not (length >= 0 and length == np.floor(length)):
                raise ValueError(f"a list of '{element.name}' has {length:g} values")
            chosen = table[:, column] == length
            behind = column + 1 + int(length)
            if behind > table.shape[1]:
                raise ValueError(f"a list of '{element.name}' is shorter than it says")
            entry = (rows[chosen], table[chosen], index + 1, behind, (*lengths, int(length)))
            pending.append(entry)


Group = tuple[Ints, dict[str, Values]]  # rows, and their values (N, n) by property


def _split(element: Element, rows: Ints, table: Values, lengths: tuple[int, ...]) -> Group:
    """Cut the numbers (N, n) of rows of one layout into properties."""
    found, column, left = {}, 0, list(lengths)
    for each in element.properties:
        if each.count_kind is None:
            found[each.name] = _as_kind(table[:, column], each)
            column += 1
        else:
            length = left.pop(0)
            found[each.name] = _as_kind(table[:, column + 1 : column + 1 + length], each)
            column += 1 + length
    return rows, found


def _as_kind(values: Values, each: Property) -> Values:
    """Convert numbers to the type of a property, if they are of it."""
    if each.kind[0] == "f":
        return values.astype(each.kind)
    limits = np.iinfo(each.kind)
    fits = (values >= limits.min) & (values <= limits.max) & (values == np.floor(values))
    if not fits.all():
        raise ValueError(f"'{each.name}' holds {values[~fits][0]:g}, which its type does not have")
    return values.astype(each.kind)


def _columns(element: Element, groups: list[Group]) -> Columns:
    """Put groups of rows together in their order."""
    columns: Columns = {}
    for each in element.properties:
        parts = [(rows, found[each.name]) for rows, found in groups]
        if each.count_kind is None:
            numbers = np.zeros(element.count, each.kind)
            for rows, values in parts:
                numbers[rows] = values
            columns[each.name] = numbers
            continue
        counts = np.zeros(element.count, np.int64)
        for rows, values in parts:
            counts[rows] = values.shape[1]
        first = np.cumsum(counts) - counts
        whole = np.zeros(int(counts.sum()), each.kind)
        for rows, values in parts:
            whole[first[rows, None] + np.arange(values.shape[1])] = values
        columns[each.name] = Lists(counts, whole)
    return columns


def _read_binary(element: Element, body: bytes, order: str) -> tuple[Columns, bytes]:
    """Read an element whose rows are bytes; return its columns and what follows."""
    if not element.properties or not element.count:
        return _columns(element, []), body
    offsets, lengths = _rows(element, body, order)
    kinds, kind_of = np.unique(lengths, axis=0, return_inverse=True)
    kind_of = kind_of.reshape(-1)
    letters, groups = np.frombuffer(body, np.uint8), []
    end = 0
    for number, layout in enumerate(kinds):
        dtype = _dtype(element, order, layout.tolist())
        rows = np.flatnonzero(kind_of == number)
        starts = offsets[rows]
        end = max(end, int(starts[-1]) + dtype.itemsize)
        if len(rows) == element.count:
            records = np.frombuffer(body, dtype, len(rows))
        else:
            taken = letters[starts[:, None] + np.arange(dtype.itemsize)]
            records = np.ascontiguousarray(taken).view(dtype)[:, 0]
        found = {each.name: records[f"{index}"] for index, each in enumerate(element.properties)}
        groups.append((rows, found))
    return _columns(element, groups), body[end:]


def _dtype(element: Element, order: str, lengths: list[int]) -> np.dtype[Any]:
    """Return the layout of a row whose lists have these lengths; properties go by their number."""
    fields: list[Any] = []
    left = list(lengths)
    for index, each in enumerate(element.properties):
        if each.count_kind is None:
            fields.append((f"{index}", order + each.kind))
        else:
            fields.append((f"count {index}", order + each.count_kind))
            fields.append((f"{index}", order + each.kind, (left.pop(0),)))
    return np.dtype(fields)


def _rows(element: Element, body: bytes, order: str) -> tuple[Ints, Ints]:
    """Find where rows begin (N,), and the lengths of their lists (N, L).

    Raises:
        ValueError: They reach beyond the end.
    """
    count = element.count
    is_list = [each.count_kind is not None for each in element.properties]
    first = _lengths_at(element, body, order, 0)
    if first is not None:
        dtype = _dtype(element, order, first)
        if count * dtype.itemsize <= len(body):
            records = np.frombuffer(body, dtype, count)
            names = [f"count {index}" for index, one in enumerate(is_list) if one]
            if all((records[n] == k).all() for n, k in zip(names, first, strict=True)):
                offsets = np.arange(count, dtype=np.int64) * dtype.itemsize
                return offsets, np.tile(np.array(first, np.int64), (count, 1))
    if not any(is_list) or count > len(body):
        raise _cut_short(element)
    offsets, lengths, start = np.empty(count, np.int64), [], 0
    sizes: dict[tuple[int, ...], int] = {}
    for row in range(count):
        found = _lengths_at(element, body, order, start)
        if found is None:
            raise _cut_short(element, row)
        offsets[row] = start
        lengths.append(found)
        key = tuple(found)
        if key not in sizes:
            sizes[key] = _dtype(element, order, found).itemsize
        start += sizes[key]
    if start > len(body):
        raise _cut_short(element, count - 1)
    return offsets, np.array(lengths, np.int64).reshape(count, -1)


def _cut_short(element: Element, row: int | None = None) -> ValueError:
    place = f"after {row} of" if row is not None else "before the last of"
    return ValueError(
        f"it ends {place} {element.count} rows of '{element.name}'; download or export it again"
    )


def _lengths_at(element: Element, body: bytes, order: str, start: int) -> list[int] | None:
    """Return the lengths of the lists of the row that begins at ``start``, None beyond the end."""
    found = []
    byte_order: Literal["big", "little"] = "big" if order == ">" else "little"
    for each in element.properties:
        size = int(each.kind[1])
        if each.count_kind is None:
            start += size
            continue
        width = int(each.count_kind[1])
        if start + width > len(body):
            return None
        word = body[start : start + width]
        length = int.from_bytes(word, byte_order, signed=each.count_kind[0] == "i")
        if length < 0 or start + width + length * size > len(body):
            return None
        found.append(length)
        start += width + length * size
    return found if start <= len(body) else None
