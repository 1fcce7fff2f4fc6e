"""The command ``synfeal build``."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from shlex import quote

from synfeal.cli.options import command, keywords, option

# Where the map finds fewer of the pictures that it was tried on, something is wrong with it.
EXPECTED_SHARE = 0.5

log = logging.getLogger("synfeal")


@command(
    "build a place from a capture or a mesh, to localize photographs in it",
    "synfeal build corridor/All_Data --out corridor",
    option(
        "source",
        "folder or file of a capture (docs/captures.md), or a textured mesh",
        type=Path,
        metavar="CAPTURE",
    ),
    option("--out", "folder of the place", type=Path, required=True, metavar="DIR"),
    option(
        "--format",
        "format of the capture, where its files fit several (found from the files)",
        metavar="NAME",
    ),
    option(
        "--frames",
        "number of frames rendered of the scan for the map (1000)",
        type=int,
        default=1000,
        metavar="N",
    ),
    option("--width", "their width, pixels (320)", type=int, default=320, metavar="PX"),
    option("--train", "train a localizer on them, too", action="store_true"),
    option("--cores", "number of rendering processes (1)", type=int, default=1, metavar="N"),
    option("--seed", "seed of all random numbers (0)", type=int, default=0),
    function="baselines.api:build",
)
def build(arguments: argparse.Namespace) -> None:
    """Scan a capture, or take a mesh as it is, render frames of it, and map them.

    After an interruption the same command continues. report.html in the folder shows the scan
    beside photographs, and how exactly photographs of the capture itself are localized.
    """
    from baselines.api import build as make
    from baselines.places.place import Place

    if arguments.train:  # minutes, of which it tells how many are left
        logging.getLogger("baselines.training").setLevel(logging.INFO)
    try:
        record = make(**keywords(arguments, build))
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt("run the same command again to go on") from interrupt
    check = record["check"]
    errors = ""
    if check["position_m"] is not None:
        errors = f", {check['position_m']:.3f} m / {check['orientation_deg']:.2f} degrees (medians)"
    print(f"{check['localized']} of {check['pictures']} {check['kind']} localized{errors}")
    if check["localized"] < EXPECTED_SHARE * check["pictures"]:
        log.warning(
            "%s: the map finds fewer than half of the %s, and will find no more of other"
            " photographs; the report shows what it was made of",
            arguments.out,
            check["kind"],
        )
    if record.get("localizer"):
        learned = record["localizer"]
        print(
            f"{Place(arguments.out).localizer}: {learned['position_m']:.3f} m /"
            f" {learned['orientation_deg']:.2f} degrees on held-out renderings (medians)"
        )
    print(f"{Place(arguments.out).report}: look at it")
    print(f"synfeal localize {quote(str(arguments.out))} photos/ --out poses.csv")
