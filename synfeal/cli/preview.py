"""``synfeal preview``: the paths of a data set as a moving picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from synfeal.cli.options import Command, Options

OPTIONS: Options = (
    (
        "datasets",
        {
            "type": Path,
            "nargs": "+",
            "metavar": "DATASET",
            "help": "data set of collect; several are shown side by side",
        },
    ),
    ("--out", {"type": Path, "help": "GIF or MP4 to write (preview.gif in the first data set)"}),
    ("--frames", {"type": int, "default": 120, "help": "frames to show, from the first (120)"}),
    ("--fps", {"type": float, "default": 12.0, "help": "frames a second, at most 50 (12)"}),
    ("--split", {"choices": ("train", "test"), "default": "train", "help": "(train)"}),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from synfeal.dataset.preview import write_preview

    out = arguments.out or arguments.datasets[0] / "preview.gif"
    shown = write_preview(arguments.datasets, out, arguments.frames, arguments.fps, arguments.split)
    print(f"{out}: {shown} frames")


COMMAND = Command(
    "preview",
    "see the paths of a data set as a moving picture",
    "Writes a GIF or MP4 of the first frames of a data set; of several, with other effects on the"
    " same paths for example, side by side under their names.",
    "synfeal preview clean blurred --out both.gif",
    OPTIONS,
    run,
)
