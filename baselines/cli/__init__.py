"""Commands of ``synfeal`` that work on data sets and trained models."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from baselines.cli import mapping, places, serving, training
from synfeal.cli.options import command, keywords, option

DEVICES = ("auto", "cpu", "cuda")


@command(
    "estimate poses of your own pictures with a trained model or a map",
    "synfeal localize trained/model.pt photos/ --out poses.csv",
    option(
        "model",
        "folder of synfeal build or synfeal map, or model.pt of synfeal train or of the benchmark",
        type=Path,
        metavar="MODEL",
    ),
    option(
        "images",
        "PNG, JPEG or HEIC of any size, or a directory; a map needs their focal length, and"
        " without it a model assumes the field of view of its training frames, which is printed",
        type=Path,
        nargs="+",
        metavar="IMAGE",
    ),
    *training.LOCALIZE_OPTIONS,
    *mapping.MAP_OPTIONS,
    option("--out", "file to write (poses.csv)", type=Path, default=Path("poses.csv")),
    option("--device", "with a model: where to run (auto)", choices=DEVICES),
    function="baselines.api:localize",
)
def localize(arguments: argparse.Namespace) -> None:
    """Estimate where pictures were taken, with a model or a map of that place."""
    from baselines.api import localize as estimate

    done: Any = estimate(**keywords(arguments, localize))
    report = mapping if arguments.model.is_dir() else training
    report.report_localized(arguments, done)


COMMANDS = (places.build, training.train, mapping.map, localize, serving.serve)
