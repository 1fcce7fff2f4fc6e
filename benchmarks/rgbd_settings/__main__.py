"""Command line of the benchmark."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.rgbd_settings.measure import batches_of, measure
from benchmarks.rgbd_settings.results import append_row, draw, read_rows
from benchmarks.rgbd_settings.settings import settings
from synfeal.config.models import CameraConfig
from synfeal.errors import InputError, exit_status

CAMERA = CameraConfig(width=320, height=240, horizontal_fov_deg=60.0)
BATCH_FRAMES = 251


def build_parser() -> argparse.ArgumentParser:
    """The options."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.rgbd_settings",
        description="RGB-D odometry under several settings: errors and CPU seconds of every batch"
        " as <out>.csv, and a picture of them as <out>.png. Rows that are there are kept.",
    )
    parser.add_argument(
        "--frames",
        nargs="+",
        required=True,
        metavar="SCENE=DIR",
        help="sequences of 320x240 with depth and poses, 3 cm between frames",
    )
    parser.add_argument("--batches", type=int, default=2, help="batches of each scene (2)")
    parser.add_argument("--settings", nargs="+", default=list(settings()), choices=list(settings()))
    parser.add_argument(
        "--out", type=Path, default=Path("results/benchmarks/rgbd_settings"), help="without ending"
    )
    return parser


def run(arguments: argparse.Namespace) -> None:
    """Measure what the table lacks; every row is written as soon as it is known."""
    table = arguments.out.with_suffix(".csv")
    table.parent.mkdir(parents=True, exist_ok=True)
    scenes = dict(map(_scene_of, arguments.frames))
    batches = [
        batch
        for scene, directory in scenes.items()
        for batch in batches_of(scene, directory, BATCH_FRAMES, arguments.batches)
    ]
    done = {(row["scene"], row["start_frame"], row["setting"]) for row in read_rows(table)}
    for name in arguments.settings:
        for batch in batches:
            if (batch.scene, batch.start, name) not in done:
                append_row(table, measure(batch, CAMERA, name, settings()[name]))
                draw(arguments.out.with_suffix(".png"), read_rows(table))


def _scene_of(text: str) -> tuple[str, Path]:
    name, _, directory = text.partition("=")
    if not directory:
        raise InputError(f"--frames: '{text}' must be SCENE=DIR")
    return name, Path(directory)


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    arguments = build_parser().parse_args(argv)
    return exit_status(lambda: run(arguments), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
