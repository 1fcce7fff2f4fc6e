"""``synfeal keep`` and ``synfeal restore``: finished runs in one small file, and back."""

from __future__ import annotations

import argparse
from pathlib import Path

from synfeal.cli.options import Command, Options

KEEP: Options = (
    ("results", {"type": Path, "metavar": "RESULTS", "help": "results of a run: results/mini"}),
    ("--out", {"type": Path, "help": "file to write (RESULTS/predictions.zip)"}),
)
RESTORE: Options = (
    ("package", {"type": Path, "metavar": "FILE", "help": "predictions.zip of synfeal keep"}),
    ("results", {"type": Path, "metavar": "RESULTS", "help": "where to: results/<profile>"}),
)


def run_keep(arguments: argparse.Namespace) -> None:
    """Carry out ``synfeal keep``."""
    from synfeal.report.predictions.keep import keep  # above this module, as in architecture.md

    out: Path = arguments.out or arguments.results / "predictions.zip"
    n_runs = keep(arguments.results, out)
    print(f"{out}: {n_runs} runs, {out.stat().st_size / 1e6:.1f} MB")


def run_restore(arguments: argparse.Namespace) -> None:
    """Carry out ``synfeal restore``."""
    from synfeal.report.predictions.restore import restore

    written, there = restore(arguments.package, arguments.results)
    print(f"{arguments.results}: {written} runs restored, {there} were there already")


COMMANDS = (
    Command(
        "keep",
        "predictions of finished runs in one small file",
        "Packs the predictions of all finished runs into one small file, from which every table can"
        " be made again without training.",
        "synfeal keep results/mini --out predictions.zip",
        KEEP,
        run_keep,
    ),
    Command(
        "restore",
        "finished runs back from such a file",
        "Puts the runs of such a file back, so that the workflow goes on from them.",
        "synfeal restore predictions.zip results/mini",
        RESTORE,
        run_restore,
    ),
)
