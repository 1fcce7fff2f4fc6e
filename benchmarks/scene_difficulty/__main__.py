"""Command line of the benchmark."""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.scene_difficulty.parts import PARTS
from benchmarks.scene_difficulty.survey import open_survey, read_setting
from synfeal.errors import InputError, exit_status


def build_parser() -> argparse.ArgumentParser:
    """The options."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.scene_difficulty",
        description="How hard a scene is for localisation; tables as <out>/<scene>-*.csv.",
    )
    parser.add_argument("--scene", required=True, help="a scene of the configuration")
    parser.add_argument(
        "--config",
        type=Path,
        default=Path("config/config.yaml"),
        help="configuration; camera paths and batches come from paper.yaml beside it",
    )
    parser.add_argument("--batches", type=int, default=10, help="batches to reconstruct (10)")
    parser.add_argument("--out", type=Path, required=True, help="directory of the tables")
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    parser.add_argument("--parts", default=",".join(PARTS), help=f"of {','.join(PARTS)} (all)")
    parser.add_argument(
        "--work", type=Path, help="directory that keeps the frames (default: a temporary one)"
    )
    return parser


def parts_of(text: str) -> list[str]:
    """Names of parts from a list with commas.

    Raises:
        InputError: one of them is no part.
    """
    names = text.split(",")
    for name in names:
        if name not in PARTS:
            raise InputError(f"--parts: '{name}' is not one of {', '.join(PARTS)}")
    return names


def measure(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    for option in ("batches", "jobs"):
        if getattr(arguments, option) < 1:
            raise InputError(f"--{option}: must be at least 1, is {getattr(arguments, option)}")
    names = parts_of(arguments.parts)
    with work_directory(arguments.work) as work:
        survey = open_survey(
            arguments.scene,
            read_setting(arguments.config),
            work,
            arguments.out,
            arguments.batches,
            arguments.jobs,
        )
        for name in names:
            PARTS[name](survey)


@contextlib.contextmanager
def work_directory(given: Path | None) -> Iterator[Path]:
    """The directory given, or a temporary one."""
    if given is not None:
        yield given
        return
    with tempfile.TemporaryDirectory(prefix="scene-difficulty-") as temporary:
        yield Path(temporary)


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    arguments = build_parser().parse_args(argv)
    return exit_status(lambda: measure(arguments), "batches that were done are kept")


if __name__ == "__main__":
    sys.exit(main())
