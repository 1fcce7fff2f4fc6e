"""Command line of the benchmark."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.scene_difficulty.pool import run_tasks
from benchmarks.sfm_settings.measure import BatchFrames, batch_at, measure_batch
from benchmarks.sfm_settings.painted_room import painted_room, round_path, write_frames
from benchmarks.sfm_settings.results import draw, gather, write_rows
from benchmarks.sfm_settings.settings import settings
from synfeal.config.models import CameraConfig
from synfeal.dataset.directories import atomic_directory
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.errors import InputError, exit_status

CAMERA = CameraConfig(width=320, height=240, horizontal_fov_deg=60.0)
ROOM, ROOM_FRAMES = "painted_room", 251

# Frames of the sequence from one to the next, and frames of a batch: as the paper's profile has
# them at 3 cm between frames, and as the default profile does.
BATCHES = {"paper": (1, 251), "mini": (8, 26)}


def build_parser() -> argparse.ArgumentParser:
    """The options."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.sfm_settings",
        description="Structure from motion under several settings: errors and CPU seconds of every"
        " batch as <out>.csv, and a picture of them as <out>.png.",
    )
    parser.add_argument(
        "--frames",
        nargs="+",
        default=[],
        metavar="SCENE=DIR",
        help="sequences of 320x240 with poses, 3 cm between frames; the painted room is added",
    )
    parser.add_argument("--kinds", nargs="+", default=list(BATCHES), choices=list(BATCHES))
    parser.add_argument("--batches", type=int, default=2, help="batches of each kind and scene (2)")
    parser.add_argument("--settings", nargs="+", default=list(settings()), choices=list(settings()))
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    parser.add_argument("--work", type=Path, help="directory that keeps what was done, to go on")
    parser.add_argument(
        "--out", type=Path, default=Path("results/benchmarks/sfm_settings"), help="without ending"
    )
    return parser


def measure(arguments: argparse.Namespace) -> None:
    """Carry out the command; what was measured is written even when it is interrupted."""
    with tempfile.TemporaryDirectory(prefix="sfm-settings-") as temporary:
        work = arguments.work or Path(temporary)
        chosen = {name: settings()[name] for name in arguments.settings}
        scenes = dict(map(_scene_of, arguments.frames)) | {ROOM: _room(work)}
        tasks = [
            (batch, CAMERA, chosen, work / "batches")
            for kind in arguments.kinds
            for scene, frames in scenes.items()
            for batch in _batches(scene, frames, kind, arguments.batches)
        ]
        try:
            run_tasks(measure_batch, tasks, arguments.jobs, "batches")
        finally:
            rows = gather(work / "batches")
            write_rows(arguments.out.with_suffix(".csv"), rows)
            draw(arguments.out.with_suffix(".png"), rows)


def _scene_of(text: str) -> tuple[str, Path]:
    name, _, directory = text.partition("=")
    if not directory:
        raise InputError(f"--frames: '{text}' must be SCENE=DIR")
    return name, Path(directory)


def _room(work: Path) -> Path:
    """Frames of the painted room, rendered when they are not there."""
    directory = work / ROOM
    if not directory.exists():
        room = painted_room(np.random.default_rng(0))
        with atomic_directory(directory) as partial:
            write_frames(room, round_path(ROOM_FRAMES, 0.03), CAMERA, partial)
    return directory


def _batches(scene: str, frames: Path, kind: str, count: int) -> list[BatchFrames]:
    """The first batches that fit into a sequence, each of which begins where the last ends."""
    every, length = BATCHES[kind]
    n_frames = len(frame_paths([frames], "color.png"))
    reach = every * (length - 1)
    starts = [k * reach for k in range(count) if (k + 1) * reach < n_frames]
    return [batch_at(scene, frames, every, start, length) for start in starts]


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    arguments = build_parser().parse_args(argv)
    return exit_status(lambda: measure(arguments), "settings that were done are kept in --work")


if __name__ == "__main__":
    sys.exit(main())
