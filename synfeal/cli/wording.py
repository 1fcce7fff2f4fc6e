"""Answers of functions in the words of the command line: arguments of Python as flags."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from synfeal.errors import Argument, InputError

if TYPE_CHECKING:
    from synfeal.cli.options import Command

# An argument of Python in a text, alone or with a value: `unit_m`, `depth_scale=5000`.
MARKED = re.compile(r"`([a-z][a-z0-9_]*)(?:=([^`]*))?`")
PYTHON_ALONE = re.compile(r"[(),\"']")  # signs of a value that a shell does without


def in_flags(text: str, flag_of: Callable[[str], str | None]) -> str:
    """Write the arguments that a text names as they are given to a command.

    Args:
        text: Text with arguments of Python between backticks.
        flag_of: Flag, or place, of an argument; None for words that are none.
    """

    def written(found: re.Match[str]) -> str:
        argument, value = found.groups()
        flag = flag_of(argument)
        if flag is None:
            return found[0]
        if value == "False":
            return f"--no-{flag.removeprefix('--')}"
        if value is None or value == "True":
            return flag
        return f"{flag} {PYTHON_ALONE.sub('', value)}"

    return MARKED.sub(written, text)


class Wording:
    """Names of arguments on the command line."""

    def __init__(self, command: Command | None, others: Sequence[Command]) -> None:
        """Take names from commands.

        Args:
            command: The command that runs, whose names come first; None before one is chosen.
            others: Commands that its answers may name.
        """
        own = (command,) if command is not None else ()
        self._flags: dict[str, str] = {}
        for each in (*own, *others):
            for name, flag in each.flags.items():
                self._flags.setdefault(name, flag)

    def name(self, argument: str) -> str:
        """Return the flag of an argument, or its place where it has none."""
        return self._flags.get(argument, argument)

    def text(self, text: str) -> str:
        """Write the arguments that a text names as they are given to a command."""
        return in_flags(text, self._flags.get)

    @contextmanager
    def of_errors(self) -> Iterator[None]:
        """Say errors that the block raises in the words of the command line."""
        try:
            yield
        except InputError as error:
            raise self._said(error) from error

    def _said(self, error: InputError) -> InputError:
        if not error.problem:
            return InputError(self.text(str(error.where)))
        is_argument = isinstance(error.where, Argument)
        where = self.name(str(error.where)) if is_argument else error.where
        return InputError(where, self.text(error.problem), self.text(error.remedy))


class Formatter(logging.Formatter):
    """Formatter of log lines in the words of the command line.

    Attributes:
        wording: Names of arguments; replaced when the command is known.
    """

    def __init__(self, wording: Wording) -> None:
        super().__init__("%(levelname)s: %(message)s")
        self.wording = wording

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of a record."""
        return self.wording.text(super().format(record))
