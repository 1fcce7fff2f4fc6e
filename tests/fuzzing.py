"""Damaged inputs, made systematically, and what a reader may answer: a value that keeps its
promise, or one line that names the file."""

from __future__ import annotations

import copy
import json
import re
import resource
import shutil
import signal
import traceback
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from synfeal.errors import InputError

SECONDS = 5.0
MEMORY_BYTES = 4 * 2**30  # beyond what the process has already
LONGEST_MESSAGE = 1000

# Cells of a table of numbers, none of which the column it is put into may be taken for silently.
WORDS = (
    *("", "x", "nan", "inf", "-inf", "1e400", "1e30", "-1e300", "-1", "0.5", "0", "0x10", "true"),
    *("9" * 400, "9" * 5000, "..", "1;2", "a\0b", "\ufeff1", "'1'", "1 2"),
)
JUNK = (
    *(None, True, -1, 0.5, 1e30, 10**400, float("nan"), float("inf"), "", "x", "..", [], {}),
    *([[]], {"x": 1}, "9" * 5000),
)
DEEP = 100_000  # levels of nesting, beyond any parser's stack


class TooSlow(BaseException):
    """No ``Exception``, so that no reader takes it for a damaged file."""


@dataclass(frozen=True)
class Damage:
    """What stands in place of a file.

    Attributes:
        label: how it was made.
        content: bytes; None for nothing at all.
        special: ``directory`` or ``loop`` (a link to itself, which nobody can open).
    """

    label: str
    content: bytes | None = None
    special: str = ""


def damages(data, others, seed, n_flips=40):
    """What can happen to any file."""
    yield Damage("missing")
    yield Damage("a directory", special="directory")
    yield Damage("a link to itself", special="loop")
    yield Damage("empty", b"")
    for length in sorted({1, 4, 11, len(data) // 3, len(data) // 2, len(data) - 9, len(data) - 1}):
        if 0 < length < len(data):
            yield Damage(f"cut at {length} of {len(data)}", data[:length])
    for name, content in others.items():
        if content != data:
            yield Damage(f"swapped with {name}", content)
    yield Damage("twice", data + data)
    yield Damage("zeros", bytes(len(data)))
    middle = len(data) // 2
    yield Damage("zeros inside", data[:middle] + bytes(64) + data[middle + 64 :])
    yield Damage("latin-1", b"caf\xe9\n" + data)
    yield Damage("latin-1 inside", data[:middle] + b"\xe9\xff" + data[middle:])
    yield Damage("byte order mark", b"\xef\xbb\xbf" + data)
    yield Damage("UTF-16", b"\xff\xfe" + data.decode("latin-1").encode("utf-16-le"))
    rng = np.random.default_rng(seed)
    for place in rng.integers(0, min(len(data), 400), n_flips):  # headers, where most is decided
        yield _flipped(data, int(place), int(rng.integers(1, 256)))
    for place in rng.integers(0, len(data), n_flips):
        yield _flipped(data, int(place), int(rng.integers(1, 256)))


def _flipped(data, place, bits):
    changed = bytearray(data)
    changed[place] ^= bits
    return Damage(f"byte {place} xor {bits:#x}", bytes(changed))


def text_damages(data, separator):
    """What can happen to a table: its lines, its columns, and the cells of its second line."""
    lines = data.decode().splitlines()
    middle = len(lines) // 2
    changed = {
        "CRLF": "\r\n".join(lines),
        "blank lines": "\n\n".join(lines),
        "one line": " ".join(lines),
        "backwards": "\n".join(lines[::-1]),
        "without its first line": "\n".join(lines[1:]),
        "without a line": "\n".join(lines[:middle] + lines[middle + 1 :]),
        "without its last line": "\n".join(lines[:-1]),
        "first line only": lines[0],
        "a line twice": "\n".join([*lines[: middle + 1], *lines[middle:]]),
        "a line of noise": "\n".join([*lines, "\x1b[31m" + "x" * 100_000]),
        "quotes": "\n".join([*lines, '"open quote']),
        "NUL": "\n".join([*lines, "\0"]),
    }
    for label, text in changed.items():
        yield Damage(label, text.encode())
    rows = [line.split(separator) for line in lines]
    for column in range(len(rows[1])):
        without = [row[:column] + row[column + 1 :] for row in rows]
        yield Damage(f"without column {column}", _joined(without, separator))
        doubled = [row[: column + 1] + row[column:] for row in rows]
        yield Damage(f"column {column} twice", _joined(doubled, separator))
        if column:
            order = [*range(column - 1), column, column - 1]
            swapped = [
                [*(row[i] for i in order if i < len(row)), *row[column + 1 :]] for row in rows
            ]
            yield Damage(f"columns {column - 1} and {column} swapped", _joined(swapped, separator))
        for word in WORDS:
            cells = [*rows[1][:column], word, *rows[1][column + 1 :]]
            table = [rows[0], cells, *rows[2:]]
            yield Damage(f"column {column} is {word[:20]!r}", _joined(table, separator))


def _joined(rows, separator):
    return "\n".join(separator.join(row) for row in rows).encode() + b"\n"


def json_damages(data):
    """Each value of a JSON file replaced and removed, and what is no mapping at all."""
    value = json.loads(data)
    for junk in JUNK:
        yield Damage(f"only {str(junk)[:20]!r}", json.dumps(junk).encode())
    yield Damage("deep lists", b"[" * DEEP)
    yield Damage("deep mappings", b'{"a":' * DEEP)
    yield Damage("a number of 5000 digits", b'{"a": ' + b"9" * 5000 + b"}")
    yield Damage("a lone surrogate", b'{"\\ud800": "\\ud800"}')
    for place in _places(value):
        name = "/".join(map(str, place))
        for junk in JUNK:
            text = json.dumps(replaced(value, place, junk))
            yield Damage(f"{name} is {str(junk)[:20]!r}", text.encode())
        yield Damage(f"without {name}", json.dumps(removed(value, place)).encode())
        beside = replaced(value, (*place, "surplus"), 1) if is_mapping(value, place) else value
        yield Damage(f"more in {name}", json.dumps(beside).encode())


def _places(value, place=()):
    """Keys that lead to every value; of a list, its first and its last."""
    entries = []
    if isinstance(value, dict):
        entries = list(value.items())
    elif isinstance(value, list):
        entries = [(i, value[i]) for i in sorted({0, len(value) - 1}) if value]
    for key, inner in entries:
        yield (*place, key)
        yield from _places(inner, (*place, key))


def replaced(value, place, new):
    """A copy in which another value stands at ``place``."""
    if not place:
        return new
    changed = copy.copy(value)
    changed[place[0]] = replaced(value[place[0]], place[1:], new) if place[1:] else new
    return changed


def is_mapping(value, place):
    """Whether a mapping stands at ``place``."""
    for key in place:
        value = value[key]
    return isinstance(value, dict)


def removed(value, place):
    """A copy without what stands at ``place``."""
    changed = copy.copy(value)
    if len(place) == 1:
        del changed[place[0]]
    else:
        changed[place[0]] = removed(value[place[0]], place[1:])
    return changed


def put(path, damage):
    """Put a damage in the place of a file."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    if damage.special == "directory":
        path.mkdir()
    elif damage.special == "loop":
        path.symlink_to(path.name)
    elif damage.content is not None:
        path.write_bytes(damage.content)


@contextmanager
def at_most(seconds):
    """End what takes longer, with :class:`TooSlow`: processor seconds, as others work here too.

    What waits without working is ended after ten times as long.
    """

    def late(*_):
        raise TooSlow

    limits = {
        signal.SIGPROF: (signal.ITIMER_PROF, seconds),
        signal.SIGALRM: (signal.ITIMER_REAL, 10 * seconds),
    }
    before = {number: signal.signal(number, late) for number in limits}
    for timer, limit in limits.values():
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for timer, _ in limits.values():
            signal.setitimer(timer, 0)
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def little_memory():
    """No more than 4 GiB beyond what is there: a header that asks for more must not get it."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = pages * resource.getpagesize() + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def problem_with(read, is_valid, names, folder=None):
    """What is wrong with how a reader took an input; None if nothing is.

    Args:
        read: reads it.
        is_valid: whether a value keeps what the reader promises.
        names: of which a refusal has to say one.
        folder: in which a refusal may leave nothing.
    """
    before = _tree(folder)
    try:
        with at_most(SECONDS):
            value = read()
    except InputError as refusal:
        if _tree(folder) != before:
            return "refused, but something was written"
        return problem_with_message(str(refusal), names)
    except TooSlow:
        return f"took more than {SECONDS:g} s"
    except Exception as error:
        at = traceback.extract_tb(error.__traceback__)[-1]
        ours = [f for f in traceback.extract_tb(error.__traceback__) if "site-p" not in f.filename]
        mine = f"{Path(ours[-1].filename).name}:{ours[-1].lineno} " if ours else ""
        return f"{mine}{type(error).__name__}: {str(error)[:90]} ({Path(at.filename).name})"
    try:
        return None if is_valid(value) else f"accepted: {str(value)[:90]!r}"
    except Exception as error:
        return f"accepted what cannot be used: {type(error).__name__} {str(error)[:90]}"


# What only a programmer says: classes, addresses, codecs, an empty reason, a name said twice.
JARGON = re.compile(
    r"<\w+[. ]| at 0x[0-9a-f]{4}|[A-Z]\w+Error\b|Errno|NoneType|codec|object (has|is)\b"
    r"|convert string|invalid literal|inhomogeneous|indices|unhashable|operand|instance of|\(\)|: :"
    r"|\b(\w+): \1: "
)


def problem_with_message(message, names):
    if "\n" in message or len(message.splitlines()) > 1:
        return f"more than one line: {message[:90]!r}"
    if len(message) > LONGEST_MESSAGE:
        return f"a line of {len(message)} characters: {message[:90]!r}"
    if jargon := JARGON.search(message):
        return f"says {jargon.group()!r}: {message[:200]!r}"
    if not any(name in message for name in names):
        return f"names none of {names}: {message[:90]!r}"
    return None


def _tree(folder):
    if folder is None:
        return {}
    found = ((path, path.lstat()) for path in folder.rglob("*"))
    return {str(path): (at.st_size, at.st_mtime_ns) for path, at in found}
