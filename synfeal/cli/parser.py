"""The parser of the command ``synfeal``: its own commands, and those of packages beside it."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, NoReturn

from synfeal import __version__
from synfeal.cli import capturing, datasets, meshes
from synfeal.cli.options import Command, in_words_of_today, numbers_apart
from synfeal.cli.wording import Formatter, Wording
from synfeal.errors import InputError

DESCRIPTION = (
    "Make data sets for camera localization from meshes; train, localize and evaluate on them."
)


class OneLineParser(argparse.ArgumentParser):
    """Parser that reports wrong usage in one line and guesses no option from its beginning."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        """End the program with the message."""
        self.exit(2, f"error: {message}; see {self.prog} --help\n")


OWN_COMMANDS: tuple[Command, ...] = (
    capturing.unpack,
    meshes.scan,
    meshes.collect,
    meshes.plan,
    meshes.inspect,
    datasets.preview,
    datasets.validate,
    datasets.export,
    datasets.pairs,
    datasets.evaluate,
)
# Installed packages that work on data sets add theirs here: an entry point names a module whose
# ``COMMANDS`` are a tuple of :class:`synfeal.cli.options.Command`.
ENTRY_POINTS = "synfeal.commands"
# Where commands come from that pages name and an installation may lack.
DISTRIBUTIONS = {
    "synfeal-baselines": ("build", "train", "map", "localize", "serve"),
    "synfeal-reproduction": ("cost", "profile", "run", "compare"),
}


def added_commands() -> tuple[Command, ...]:
    """List the commands of the packages installed beside the simulator."""
    found = sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: entry.name)
    return tuple(command for entry in found for command in entry.load().COMMANDS)


def all_commands() -> tuple[Command, ...]:
    """List the simulator's own commands, then those of the packages installed beside it."""
    return (*OWN_COMMANDS, *added_commands())


def _path(typed: str) -> Path:
    """Convert an argument to a path; an empty one would stand for the working directory."""
    if not typed:
        raise argparse.ArgumentTypeError("is empty; is a variable of the shell not set?")
    return Path(typed)


def build_parser(commands: Sequence[Command]) -> argparse.ArgumentParser:
    """Build the parser of the ``synfeal`` command."""
    parser = OneLineParser(prog="synfeal", description=DESCRIPTION)
    parser.add_argument("--version", action="version", version=f"synfeal {__version__}")
    subparsers = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in commands:
        added = subparsers.add_parser(
            command.name,
            help=command.summary,
            description=command.description,
            epilog=f"example: {command.example}",
        )
        for flag, details in command.options:
            kind = details.get("type")
            added.add_argument(flag, **details | ({"type": _path} if kind is Path else {}))
        added.set_defaults(action=command, usage=added)
    return parser


def refuse_absent(argv: Sequence[str], commands: Sequence[Command]) -> None:
    """Refuse a command of a distribution that is not installed, and say which one has it.

    Raises:
        InputError: The first argument is such a command.
    """
    name = argv[0] if argv else ""
    if name in [command.name for command in commands]:
        return
    for distribution, names in DISTRIBUTIONS.items():
        if name in names:
            raise InputError(
                f"synfeal {name}",
                f"comes with {distribution}, which is not installed beside synfeal",
                f"pip install {distribution}, or ./{distribution.removeprefix('synfeal-')} of a"
                " clone (docs/installing.md)",
            )


def run(argv: Sequence[str] | None) -> None:
    """Carry out a command line.

    Raises:
        InputError: Something that a person can fix; it names options as they are typed.
        SystemExit: Wrong usage (2), or help was asked for (0).
    """
    commands = all_commands()
    handler, formatter = logging.StreamHandler(), Formatter(Wording(None, commands))
    handler.setFormatter(formatter)
    logging.basicConfig(handlers=[handler], level=logging.WARNING)
    every = tuple(option for command in commands for option in command.options)
    given = in_words_of_today(sys.argv[1:] if argv is None else argv, commands)
    refuse_absent(given, commands)
    arguments, unknown = build_parser(commands).parse_known_args(list(numbers_apart(given, every)))
    if unknown:  # the command's own parser reports it, with its usage
        arguments.usage.error(f"unrecognized arguments: {' '.join(unknown)}")
    wording = formatter.wording = arguments.wording = Wording(arguments.action, commands)
    with wording.of_errors():
        arguments.action(arguments)
