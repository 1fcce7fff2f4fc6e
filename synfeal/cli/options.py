"""What the commands share: how options are declared, and the options that describe a mesh."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

# Flag, and what argparse is told about it.
Options = tuple[tuple[str, dict[str, Any]], ...]


@dataclass(frozen=True)
class Command:
    """One sub-command of ``synfeal``.

    Attributes:
        name: as it is typed.
        summary: a few words for ``synfeal --help``.
        description: a sentence for its own help.
        example: a line a person may type.
        options: its options.
        run: carries it out; imports what it needs when it is called, so that ``--help`` is quick.
    """

    name: str
    summary: str
    description: str
    example: str
    options: Options
    run: Callable[[argparse.Namespace], None]


MESH_OPTIONS: Options = (
    (
        "--box",
        {
            "type": float,
            "nargs": 6,
            "action": "append",
            "metavar": ("X0", "X1", "Y0", "Y1", "Z0", "Z1"),
            "help": "where camera centres may be, metres (the mesh's bounds); again for each"
            " further room or floor",
        },
    ),
    ("--up-axis", {"choices": ("auto", "y", "z"), "help": "up in the file (auto)"}),
    ("--unit-m", {"type": float, "help": "metres per unit of the file (1)"}),
)


def options_among(arguments: argparse.Namespace, names: Collection[str]) -> dict[str, Any]:
    """The options of these names that the command has, by name."""
    return {name: value for name, value in vars(arguments).items() if name in names}


def numbers_apart(arguments: Sequence[str], options: Options) -> Iterator[str]:
    """Arguments as argparse reads negative numbers of all forms, and ``--box=0 1 ...`` too.

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
