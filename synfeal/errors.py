"""The exception for errors that a user can fix, and its handling by entry points."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

LONGEST = 900  # characters of a message
BROKEN_PIPE = 141  # exit status, as of a program that SIGPIPE ends

# What parsers say of their own insides, which helps nobody with a file.
INSIDES = re.compile(
    r"__|magic string|inhomogeneous|broadcast|unpack|not aligned|concatenat|itemsize"
    r"|index-sized|dimension|mmap|unhashable|object (has|is)|set_int_max_str|^[\s\d.+-]*$"
)
OBJECT = re.compile(
    r" ?<[^<>]* at 0x[0-9a-f]+>| ?<_io\.[^<>]*>|, line \d+, column \d+: .*| in \"<[a-z ]+>\""
)
TOKEN = re.compile(r"<([a-z ]+)>")  # of YAML
NO_NUMBER = re.compile(r"(could not convert string to float|invalid literal for int\(\).*?): (.*)")
UNFIT = "its parts do not fit together"


@dataclass(frozen=True)
class Argument:
    """Argument of a function, where that is what an error is about.

    Attributes:
        name: Its name in Python, such as ``spacing_m``; the command line shows its flag instead.
    """

    name: str

    def __str__(self) -> str:
        return self.name


class InputError(Exception):
    """Input from a user that cannot be used.

    As text it is one line, ``where: problem; remedy``. Entry points print it without a traceback
    and exit with status 1; every other exception is a defect and keeps its traceback.

    Problem and remedy name arguments as Python has them, between backticks and with a value where
    that helps: "give `unit_m`", "give `depth_scale=5000`". The command line writes them as flags
    (:mod:`synfeal.cli.wording`), so a function answers its caller in the words of the call.

    Attributes:
        where: The file, a text that names a place in it, or the :class:`Argument`; a message about
            neither may stand here alone.
        problem: What is wrong there.
        remedy: What to do about it, in the imperative.
    """

    def __init__(self, where: object, problem: str = "", remedy: str = "") -> None:
        super().__init__(where, problem, remedy)
        self.where, self.problem, self.remedy = where, problem, remedy

    def __str__(self) -> str:
        answer = "; ".join(filter(None, (self.problem, self.remedy)))
        message = f"{self.where}: {answer}" if answer else str(self.where)
        line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
        if len(line) > LONGEST:  # what a file holds is quoted in part; the remedy stands at the end
            line = f"{line[: LONGEST - 200]} ... {line[-190:]}"
        return line


def exit_status(action: Callable[[], object], if_interrupted: str) -> int:
    """Run a command; return 0, or print ``error: ...`` for what a person can fix and return 1.

    That is an :class:`InputError`, too little memory, and what the system refuses: a full or
    read-only disk, a name that is too long, links that lead in a circle. Ctrl-C is 130, with what
    it leaves behind: ``if_interrupted``, unless the ``KeyboardInterrupt`` says it itself. SIGTERM
    is taken as Ctrl-C, and is 143.
    """
    ended: list[int] = []
    try:
        with _terminated_as_interrupted(ended):
            action()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        if isinstance(error, BrokenPipeError) and error.filename is None:
            # Whoever read what is printed has read enough, as ``head`` does.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return BROKEN_PIPE
        if error.strerror is None:  # no system call failed: a defect
            raise
        name = file_of(error)
        place = f"{name}: " if name else ""
        print(f"error: {InputError(f'{place}{error.strerror}; {if_interrupted}')}", file=sys.stderr)
        return 1
    except MemoryError as error:
        wanted = f" ({error})" if str(error) else ""
        remedy = "end other programs, or use a machine with more"
        line = InputError(f"out of memory{wanted}; {remedy}; {if_interrupted}")
        print(f"error: {line}", file=sys.stderr)
        return 1
    except KeyboardInterrupt as interrupt:
        what, status = ("terminated", 143) if ended else ("interrupted", 130)
        print(f"error: {what}; {str(interrupt) or if_interrupted}", file=sys.stderr)
        return status
    return 0


def file_of(error: OSError) -> Any:
    """Return the file that an error of the system is about, or None.

    A copy that finds the disk full names its source first, which is all right.
    """
    return error.filename if error.filename2 is None else error.filename2


@contextmanager
def _terminated_as_interrupted(ended: list[int]) -> Iterator[None]:
    """Raise ``KeyboardInterrupt`` on SIGTERM, so that what is unfinished is removed.

    Args:
        ended: Takes the signal that came.
    """
    is_ours = threading.current_thread() is threading.main_thread()
    if not is_ours or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield  # handlers can be set from the main thread only; that of a caller stays
        return
    process = os.getpid()

    def end(number: int, _: FrameType | None) -> None:
        if os.getpid() != process:  # a forked child, which has nothing to say
            os._exit(128 + number)
        ended.append(number)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def read_as(path: object, what: str, *damage: type[Exception], remedy: str = "") -> Iterator[None]:
    """Turn read errors raised in the block into one line about the file.

    Args:
        path: File named in the message.
        what: Expected content, with its article ("a pose").
        damage: Exceptions to turn; ``OSError`` and ``ValueError`` if none are given.
        remedy: End of the message ("; make it again").

    Raises:
        InputError: The block raised one of ``damage``.
    """
    kinds = damage or (OSError, ValueError)
    try:
        yield
    except kinds as error:
        raise InputError(f"{path}: cannot be read as {what} ({why(error)}){remedy}") from error


# What Pydantic says of a value, by its name for the error.
WORDINGS = {
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be {ge} or more",
    "less_than": "must be below {lt}",
    "less_than_equal": "must be {le} or less",
    **dict.fromkeys(
        ("int_type", "int_parsing", "int_from_float", "int_parsing_size"), "must be a whole number"
    ),
    **dict.fromkeys(("float_type", "float_parsing"), "must be a number"),
    "finite_number": "must be a finite number",
    **dict.fromkeys(("bool_type", "bool_parsing"), "must be true or false"),
    **dict.fromkeys(("string_type", "string_sub_type"), "must be text"),
    "string_pattern_mismatch": "must match {pattern}",
    "string_too_long": "must have at most {max_length} characters",
    "string_too_short": "must have at least {min_length} characters",
    "literal_error": "must be {expected}",
    **dict.fromkeys(("list_type", "tuple_type"), "must be a list"),
    "too_short": "must hold at least {min_length} values",
    "too_long": "must hold at most {max_length} values",
    **dict.fromkeys(
        ("dict_type", "mapping_type", "model_type", "model_attributes_type"),
        "must hold a mapping of keys",
    ),
    "path_type": "must be a path",
    "none_required": "must be left out",
    "invalid_key": "keys must be text",
}


def wording(problem: Mapping[str, Any]) -> str:
    """Say what Pydantic found wrong with a value in the words of this project.

    Args:
        problem: An entry of ``ValidationError.errors()``.
    """
    context = {
        name: f"{value:g}" if isinstance(value, float) else value
        for name, value in problem.get("ctx", {}).items()
    }
    own = WORDINGS.get(problem["type"])
    said: str = problem["msg"] if own is None else own.format_map(context)
    return said.removeprefix("Value error, ")


def why(error: BaseException) -> str:
    """Return the reason for a read error, in words that fit in the brackets of a message.

    Names of Python classes, memory addresses and codecs are left out.
    """
    inner = getattr(error, "reason", None)  # a download has one
    if isinstance(inner, OSError):
        return why(inner)
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, UnicodeError):
        return "it is not UTF-8 text"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    if isinstance(error, KeyError) and error.args and isinstance(error.args[0], str):
        return f"'{error.args[0]}' is missing"
    if isinstance(error, AssertionError | AttributeError | LookupError | TypeError):
        return UNFIT
    mark = getattr(error, "problem_mark", None)  # of YAML, counted from 0
    line = getattr(error, "lineno", None) if mark is None else mark.line + 1  # JSON's from 1
    said = getattr(error, "problem", None) or getattr(error, "msg", None) or str(error)
    if hasattr(error, "errors"):  # pydantic's
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        said = f"{key}: {wording(first)}" if key else wording(first)
    said = OBJECT.sub("", str(said)[:LONGEST].strip().partition("\n")[0])
    said = TOKEN.sub(r"\1", NO_NUMBER.sub(r"\2 is no number", said))
    if said.startswith("but "):  # the second half of a sentence of YAML's
        said = f"{getattr(error, 'context', '')}, {said}"
    if INSIDES.search(said):
        said = UNFIT
    return f"line {line}: {said[0].lower()}{said[1:]}" if line else said
