"""``synfeal validate``: is a data set whole and consistent?"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from synfeal.cli.options import Command, Options
from synfeal.errors import InputError

OPTIONS: Options = (
    (
        "dataset",
        {"type": Path, "metavar": "DATASET", "help": "directory of seq-01 or seq-01.zip"},
    ),
    ("--camera", {"type": Path, "metavar": "FILE", "help": "calibration file (manifest.json)"}),
    (
        "--all",
        {"action": "store_true", "help": "compare every pair of frames, not a sample of 600"},
    ),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command.

    Raises:
        InputError: a check failed; the message is the last ``error:`` line.
    """
    from synfeal.validation.run import error_lines, report, validate

    checks = validate(arguments.dataset, arguments.camera, arguments.all)
    print(report(arguments.dataset, checks), end="", flush=True)
    errors = error_lines(checks)
    for line in errors[:-1]:
        print(f"error: {' '.join(line.split())}", file=sys.stderr)
    if errors:
        raise InputError(errors[-1])


COMMAND = Command(
    "validate",
    "is a data set whole and consistent?",
    "Checks files, poses, splits, hashes and geometry of a data set; exit status 1 if one fails.",
    "synfeal validate mydata",
    OPTIONS,
    run,
)
