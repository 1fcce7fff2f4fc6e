"""``synfeal export``: a data set in the format of another program."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path

from synfeal.cli.options import Command, Options

FORMATS = ("ace", "colmap", "hloc", "mstransformer", "nerfstudio", "tum")
OPTIONS: Options = (
    (
        "dataset",
        {"type": Path, "metavar": "DATASET", "help": "directory of seq-01 or seq-01.zip"},
    ),
    (
        "--to",
        {"choices": FORMATS, "required": True, "help": "format to write"},
    ),
    ("--out", {"type": Path, "required": True, "help": "directory to create"}),
    ("--copy", {"action": "store_true", "help": "copy colour images instead of linking to them"}),
    ("--camera", {"type": Path, "metavar": "FILE", "help": "calibration file (manifest.json)"}),
)

log = logging.getLogger("synfeal")


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from synfeal.export.run import export

    out: Path = arguments.out
    n_frames, warnings = export(
        arguments.dataset, arguments.to, out, arguments.copy, arguments.camera
    )
    for warning in warnings:
        log.warning(warning)
    print(f"{out}: {n_frames} frames for {arguments.to}")


COMMAND = Command(
    "export",
    "a data set for ACE, COLMAP, hloc, Nerfstudio and others",
    "Writes a 7-Scenes data set in the format of another program.",
    "synfeal export mydata --to colmap --out mydata-colmap",
    OPTIONS,
    run,
)
