"""Declaration of commands and their options, and the options of a mesh that several share."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, NamedTuple

# Flag, and its arguments of argparse.
Option = tuple[str, dict[str, Any]]
Action = Callable[[argparse.Namespace], None]


class Command(NamedTuple):
    """One sub-command of ``synfeal``, with what its own help and that of ``synfeal`` say."""

    name: str
    summary: str
    description: str
    example: str
    options: tuple[Option, ...]
    action: Action  # imports what it needs when it is called: ``--help`` is quick

    def __call__(self, arguments: argparse.Namespace) -> None:
        """Carry it out."""
        self.action(arguments)


def option(flag: str, text: str, **details: Any) -> Option:
    """Define a flag, or a positional argument, and its help; ``details`` go to argparse."""
    return flag, {"help": text, **details}


def command(summary: str, example: str, *options: Option) -> Callable[[Action], Command]:
    """Make a command of a function, whose name and docstring become its name and description."""

    def of(action: Action) -> Command:
        description = " ".join((action.__doc__ or "").split())
        return Command(action.__name__, summary, description, example, options, action)

    return of


MESH_OPTIONS = (
    option(
        "--box",
        "where camera centres may be, metres (the mesh's bounds); repeat it for further rooms or"
        " floors",
        type=float,
        nargs=6,
        action="append",
        metavar=("X0", "X1", "Y0", "Y1", "Z0", "Z1"),
    ),
    option("--up-axis", "axis that points up in the file (auto)", choices=("auto", "y", "z")),
    option("--unit-m", "metres per unit of the file (1)", type=float),
)


def options_among(arguments: argparse.Namespace, names: Collection[str]) -> dict[str, Any]:
    """Return those of the named options that the command has, by name."""
    return {name: value for name, value in vars(arguments).items() if name in names}


def numbers_apart(arguments: Sequence[str], options: Sequence[Option]) -> Iterator[str]:
    """Yield arguments so that argparse reads negative numbers of all forms, and ``--box=0 1 ...``.

    It takes ``-1e0`` for an option; a blank before it makes it a value.
    """
    several = {flag for flag, details in options if isinstance(details.get("nargs"), int)}
    for argument in arguments:
        flag, equals, value = argument.partition("=")
        parts = [flag, *value.split()] if equals and flag in several else [argument]
        yield from (f" {part}" if _is_negative(part) else part for part in parts)


def _is_negative(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text.startswith("-")
