"""The command ``synfeal unpack``."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from shlex import quote

from synfeal.cli.options import command, keywords, option

log = logging.getLogger("synfeal")


@command(
    "turn a capture of a phone, a sensor or another program into a posed sequence",
    "synfeal unpack corridor/All_Data --out corridor-sequence",
    option("capture", "folder or file of a capture", type=Path, metavar="CAPTURE"),
    option("--out", "folder to create", type=Path, required=True, metavar="DIR"),
    option(
        "--format",
        "format of the capture, where its files fit several (found from the files)",
        metavar="NAME",
    ),
    option("--stride", "take every N-th frame (1)", type=int, default=1, metavar="N"),
    function="synfeal.api:unpack",
    was={"--every": "--stride"},
)
def unpack(arguments: argparse.Namespace) -> None:
    """Read a capture in any of the formats of docs/captures.md and write frames, poses and cameras.

    The sequence is what scan, map and collect --like read, without further options.
    """
    from synfeal.api import unpack as write
    from synfeal.captures.formats import capture_formats

    done = write(**keywords(arguments, unpack))
    title = capture_formats()[done.format].title
    print(f"{arguments.capture}: {done.n_captured} frames of {title}")
    for note in done.notes:
        log.warning("%s: %s", arguments.capture, note)
    color, depth = done.color, done.depth
    size = f"{color.width} x {color.height} pixels, focal length {color.fx:.0f}"
    of_depth = "no depth" if depth is None else f"depth {depth.width} x {depth.height}"
    print(f"{arguments.out}: {len(done.names)} frames, {size}, {of_depth}")
    if depth is not None:
        print(f"synfeal scan {quote(str(arguments.out))} --out scan.glb")
