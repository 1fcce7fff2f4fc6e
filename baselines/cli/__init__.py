"""Commands of ``synfeal`` that work on data sets and trained models."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from baselines.cli import mapping, training
from synfeal.cli.options import command, option
from synfeal.errors import InputError

DEVICES = ("auto", "cpu", "cuda")


@command(
    "estimate poses of your own pictures with a trained model or a map",
    "synfeal localize trained/model.pt photos/ --out poses.csv",
    option(
        "model",
        "model.pt of synfeal train or of the benchmark, or the folder that synfeal map wrote",
        type=Path,
        metavar="MODEL",
    ),
    option(
        "images",
        "PNG or JPEG of any size, or a directory of them; a map needs their focal length, and"
        " without it a model assumes the field of view of its training frames, which is printed",
        type=Path,
        nargs="+",
        metavar="IMAGE",
    ),
    *training.LOCALIZE_OPTIONS,
    *mapping.MAP_OPTIONS,
    option("--out", "file to write (poses.csv)", type=Path, default=Path("poses.csv")),
    option("--device", "with a model: where to run (auto)", choices=DEVICES),
)
def localize(arguments: argparse.Namespace) -> None:
    """Estimate where pictures were taken, with a model or a map of that place."""
    if arguments.model.is_dir():
        _refuse(arguments, ("turns", "device"), "is for models, and a map is a folder")
        mapping.localize_by_map(arguments)
    else:
        _refuse(arguments, ("confidence", "refine"), "is for maps, which are folders")
        training.localize_by_model(arguments)


def _refuse(arguments: argparse.Namespace, options: Sequence[str], reason: str) -> None:
    """Refuse options that would have no effect.

    Raises:
        InputError: One was given.
    """
    for name in options:
        if getattr(arguments, name) is not None:
            raise InputError(f"--{name}: {reason}, such as {arguments.model}; leave it out")


COMMANDS = (training.train, mapping.map, localize)
