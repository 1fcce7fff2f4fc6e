"""Command line: look at a mesh, make a data set of it, plan and compare runs, use a model."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from synfeal import __version__
from synfeal.cli import datasets, meshes, runs
from synfeal.cli.options import numbers_apart
from synfeal.errors import exit_status


class OneLineParser(argparse.ArgumentParser):
    """Wrong usage ends in one line; no option is guessed from its beginning."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        """End with the message."""
        self.exit(2, f"error: {message}; see {self.prog} --help\n")


COMMANDS = (
    *(meshes.collect, meshes.inspect),
    *(datasets.preview, datasets.validate, datasets.export, datasets.evaluate),
    datasets.localize,
    *(runs.plan, runs.run, runs.compare, runs.keep, runs.restore),
)


def build_parser() -> argparse.ArgumentParser:
    """The parser of the ``synfeal`` command."""
    parser = OneLineParser(prog="synfeal", description=__doc__)
    parser.add_argument("--version", action="version", version=f"synfeal {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        added = commands.add_parser(
            command.name,
            help=command.summary,
            description=command.description,
            epilog=f"example: {command.example}",
        )
        for flag, details in command.options:
            added.add_argument(flag, **details)
        added.set_defaults(action=command, usage=added)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point: 0, 1 for what a person can fix, 2 for wrong usage, 130 after Ctrl-C."""
    logging.basicConfig(format="%(levelname)s: %(message)s", level=logging.WARNING)
    every = tuple(option for command in COMMANDS for option in command.options)
    given = sys.argv[1:] if argv is None else argv
    arguments, unknown = build_parser().parse_known_args(list(numbers_apart(given, every)))
    if unknown:  # said by the command's own parser
        arguments.usage.error(f"unrecognized arguments: {' '.join(unknown)}")
    return exit_status(lambda: arguments.action(arguments), "nothing was kept")
