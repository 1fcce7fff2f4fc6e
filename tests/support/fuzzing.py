"""Damaged inputs, made systematically, and what a reader may answer: a value that keeps its
promise, or one line that names the file."""

import copy
import json
import re
import resource
import shutil
import signal
import traceback
from contextlib import contextmanager
from dataclasses import dataclass
from functools import reduce
from operator import getitem
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
    """Content that stands in place of a file."""

    label: str  # how it was made
    content: bytes | None = None  # None for nothing at all
    special: str = ""  # `directory` or `loop` (a link to itself, which nobody can open)


def damages(data, others, seed, n_flips=40):
    """Damages of any file."""
    middle = len(data) // 2
    yield Damage("missing")
    yield Damage("a directory", special="directory")
    yield Damage("a link to itself", special="loop")
    cuts = {0, 1, 4, 11, len(data) // 3, middle, len(data) - 9, len(data) - 1}
    changed = {
        **{f"cut at {n} of {len(data)}": data[:n] for n in sorted(cuts) if 0 <= n < len(data)},
        **{f"swapped with {name}": content for name, content in others.items() if content != data},
        "zeros": bytes(len(data)),
        "latin-1 inside": data[:middle] + b"\xe9\xff" + data[middle:],
        "byte order mark": b"\xef\xbb\xbf" + data,
        "UTF-16": b"\xff\xfe" + data.decode("latin-1").encode("utf-16-le"),
    }
    yield from (Damage(label, content) for label, content in changed.items())
    rng = np.random.default_rng(seed)
    for most in (min(len(data), 400), len(data)):  # in headers most is decided
        for place in rng.integers(0, most, n_flips):
            bits, flipped = int(rng.integers(1, 256)), bytearray(data)
            flipped[place] ^= bits
            yield Damage(f"byte {place} xor {bits:#x}", bytes(flipped))


def text_damages(data, separator):
    """Damages of a table: its lines, its columns, and the cells of its second line."""
    lines = data.decode().splitlines()
    middle = len(lines) // 2
    changed = {
        "CRLF": [line + "\r" for line in lines],
        "without its first line": lines[1:],
        "without a line": lines[:middle] + lines[middle + 1 :],
        "first line only": lines[:1],
        "a line of noise": [*lines, "\x1b[31m" + "x" * 100_000],
        "quotes": [*lines, '"open quote'],
        "NUL": [*lines, "\0"],
    }
    rows = [line.split(separator) for line in lines]
    for n in range(len(rows[1])):
        for label, columns in (("without", ()), ("twice", (n, n)), ("before", (n, n - 1))):
            first = n - 1 if label == "before" else n
            if first >= 0:
                changed[f"{label} column {n}"] = [
                    separator.join(
                        [*row[:first], *(row[c] for c in columns if c < len(row)), *row[n + 1 :]]
                    )
                    for row in rows
                ]
        for word in WORDS:
            cells = [*rows[1][:n], word, *rows[1][n + 1 :]]
            changed[f"column {n} is {word[:20]!r}"] = [lines[0], separator.join(cells), *lines[2:]]
    for label, text in changed.items():
        yield Damage(label, "\n".join([*text, ""]).encode())


def json_damages(data):
    """Each value of a JSON file replaced and removed, and what is no mapping at all."""
    value = json.loads(data)
    yield Damage("deep lists", b"[" * DEEP)
    yield Damage("deep mappings", b'{"a":' * DEEP)
    yield Damage("a number of 5000 digits", b'{"a": ' + b"9" * 5000 + b"}")
    yield Damage("a lone surrogate", b'{"\\ud800": "\\ud800"}')
    for place in ((), *places(value, ends_alone=True)):
        name = "/".join(map(str, place))
        changed = {f"{name} is {str(junk)[:20]!r}": replaced(value, place, junk) for junk in JUNK}
        if place:
            changed[f"without {name}"] = removed(value, place)
        if isinstance(at(value, place), dict):
            changed[f"more in {name}"] = replaced(value, (*place, "surplus"), 1)
        yield from (Damage(label, json.dumps(new).encode()) for label, new in changed.items())


def places(value, place=(), ends_alone=False):
    """Keys that lead to every value; of a list all, or its first and its last."""
    entries = list(value.items()) if isinstance(value, dict) else []
    if isinstance(value, list):
        entries = list(enumerate(value))
        if ends_alone:
            entries = entries[:1] + entries[1:][-1:]
    for key, inner in entries:
        yield (*place, key)
        yield from places(inner, (*place, key), ends_alone)


def at(value, place):
    """Return what stands at a place."""
    return reduce(getitem, place, value)


def replaced(value, place, new):
    """A copy in which another value stands at ``place``."""
    if not place:
        return new
    changed = copy.deepcopy(value)
    at(changed, place[:-1])[place[-1]] = new
    return changed


def removed(value, place):
    """A copy without what stands at ``place``."""
    changed = copy.deepcopy(value)
    del at(changed, place[:-1])[place[-1]]
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
    """End what takes longer in processor time, or ten times as long on the clock."""

    def late(*_):
        raise TooSlow

    limits = (
        (signal.SIGPROF, signal.ITIMER_PROF, seconds),
        (signal.SIGALRM, signal.ITIMER_REAL, 10 * seconds),
    )
    before = [signal.signal(number, late) for number, *_ in limits]
    for _, timer, limit in limits:
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(limits, before, strict=True):
            signal.setitimer(timer, 0)
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
    """Return what is wrong with a reader's answer to an input; None if nothing is.

    It may give a value that ``is_valid``, or refuse in a line that says one of ``names``, and then
    leave nothing in ``folder``.
    """
    before = tree(folder)
    try:
        with at_most(SECONDS):
            value = read()
    except InputError as refusal:
        if tree(folder) != before:
            return "refused, but something was written"
        return problem_with_message(str(refusal), names)
    except TooSlow:
        return f"took more than {SECONDS:g} s"
    except Exception as error:
        return "".join(traceback.format_exception_only(error))[:120]
    try:
        return None if is_valid(value) else f"accepted: {str(value)[:90]!r}"
    except Exception as error:
        return f"accepted what cannot be used: {type(error).__name__} {str(error)[:90]}"


# What only a programmer says: classes, addresses, codecs, an empty reason, a name said twice.
JARGON = re.compile(
    r"<\w+[. ]| at 0x[0-9a-f]{4}|[A-Z]\w+Error\b|Errno|NoneType|codec|object (has|is)\b"
    r"|convert string|invalid literal|inhomogeneous|(?<!vertex_)indices|unhashable|operand"
    r"|instance of|\(\)|: :"
    r"|\b(\w+): \1: "
)


def problem_with_message(message, names):
    jargon = JARGON.search(message)
    problems = {
        "more than one line": len(message.splitlines()) > 1,
        f"a line of {len(message)} characters": len(message) > LONGEST_MESSAGE,
        f"says {jargon and jargon.group()!r}": jargon,
        f"names none of {names}": not any(name in message for name in names),
    }
    found = [problem for problem, is_there in problems.items() if is_there]
    return f"{found[0]}: {message[:200]!r}" if found else None


def tree(folder):
    """Size and time of all files below a folder."""
    found = ((path, path.lstat()) for path in (folder.rglob("*") if folder else ()))
    return {str(path): (state.st_size, state.st_mtime_ns) for path, state in found}
