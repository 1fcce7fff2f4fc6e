"""The command ``synfeal serve``."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.cli.mapping import MAP_OPTIONS
from baselines.cli.training import CALIBRATION_OPTIONS, WORLD_OPTION
from synfeal.cli.options import command, keywords, option


@command(
    "answer over HTTP where photographs were taken",
    "synfeal serve corridor",
    option("place", "folder of synfeal build or synfeal map", type=Path, metavar="PLACE"),
    *CALIBRATION_OPTIONS,
    WORLD_OPTION,
    *MAP_OPTIONS,
    option("--host", "address to listen on (127.0.0.1: this machine alone)", default="127.0.0.1"),
    option("--port", "port to listen on; 0: one that is free (8000)", type=int, default=8000),
    option(
        "--cores", "number of photographs localized at once (1)", type=int, default=1, metavar="N"
    ),
    option(
        "--queue",
        "number of photographs that may wait; who sends another is told to come again (16)",
        type=int,
        default=16,
        metavar="N",
    ),
    option("--megabytes", "largest request, 10^6 bytes (32)", type=int, default=32, metavar="N"),
    option(
        "--megapixels", "largest photograph, 10^6 pixels (64)", type=int, default=64, metavar="N"
    ),
    function="baselines.api:serve",
)
def serve(arguments: argparse.Namespace) -> None:
    """Load the map of a place once, and localize photographs that are sent to it.

    The page at / takes a photograph and shows where it was taken; POST /localize answers programs,
    GET /health tells that the server is there. Nothing is written. Ctrl-C stops it.
    """
    from baselines.api import serve as run

    run(**keywords(arguments, serve))
