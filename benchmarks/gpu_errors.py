r"""Errors of localizers trained on a GPU, or on a processor.

    python -m benchmarks.gpu_errors OUT/frames-small --labels OUT/labels --device cuda --out o.csv
    python -m benchmarks.gpu_errors OUT/frames-large --labels OUT/labels --device cuda \
        --models posenet posenet2 poselstm --seeds 0 --width 1 --batch 45 --seconds 60 --out o.csv

with the directory that :mod:`benchmarks.gpu_frames` fills, or with packed frames and labels of a
profile. Runs are trained as ``synfeal train`` trains, and predict the same test frames. Networks
have the side of the packed frames.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from baselines.config.learning import (
    MODELS,
    SHIPPED_WIDTH,
    AugmentationConfig,
    NetworkConfig,
    TrainingConfig,
)
from baselines.localizers.backbones.shipped import shipped_weights_path
from baselines.localizers.registry import backbone_of
from baselines.training.checkpoint import frame_camera
from baselines.training.fit import FOR_PHOTOGRAPHS
from baselines.training.predict import write_predictions
from baselines.training.run import Job, step_seconds, train_localizer
from baselines.training.train import ROTATIONS, recipe_of
from synfeal.dataset.packed import read_packed
from synfeal.errors import exit_status
from synfeal.geometry.rotations import rotation_angle_rad
from synfeal.records.tables import write_frame


class ErrorRow(NamedTuple):
    """Median errors of one run on the test frames, and the seconds that its training took."""

    localizer: str
    input_px: int
    width: float
    batch: int
    images: int
    device: str
    seed: int
    position_m: float
    orientation_deg: float
    seconds: float


class Budget(NamedTuple):
    """Length of a run.

    Attributes:
        images: Images shown.
        seconds: In their place, seconds to train for: as many images as a short trial says.
    """

    images: int
    seconds: float | None = None


def error_of(frames: Path, labels: Path, job: Job, budget: Budget) -> ErrorRow:
    """Train one localizer, and compare its predictions with the labels of the test frames.

    Args:
        frames: Directory of ``train.npy`` and ``test.npy``.
        labels: Directory of ``train.csv`` and ``test.csv``.
        job: The run, but for its length.
        budget: Its length.
    """
    shipped = job.network.width == SHIPPED_WIDTH
    weights = shipped_weights_path(backbone_of(job.name, job.network)) if shipped else None
    files = frames / "train.npy", labels / "train.csv"
    images = budget.images
    if budget.seconds is not None:
        steps = budget.seconds / step_seconds(job, *files, weights)
        images = max(1, round(steps)) * job.training.batch_size
    job = job._replace(samples_seen=images)
    with tempfile.TemporaryDirectory() as folder:
        out, began = Path(folder), time.perf_counter()
        trained = train_localizer(
            job, *files, out / "model.pt", out / "history.csv", weights=weights
        )
        seconds = time.perf_counter() - began
        poses = write_predictions(
            trained.localizer, frames / "test.npy", labels / "test.csv", out / "predictions.csv"
        )
    shift_m = poses.predicted.position_m - poses.given.position_m
    angle_rad = rotation_angle_rad(poses.predicted.quat_wxyz, poses.given.quat_wxyz)
    return ErrorRow(
        localizer=job.name,
        input_px=job.network.input_px,
        width=job.network.width,
        batch=job.training.batch_size,
        images=images,
        device=job.training.device,
        seed=job.seed,
        position_m=float(np.median(np.linalg.norm(shift_m, axis=1))),
        orientation_deg=float(np.degrees(np.median(angle_rad))),
        seconds=seconds,
    )


def jobs_of(options: argparse.Namespace) -> Iterator[Job]:
    """List the runs that options ask for; how many images they show is left open."""
    packed = options.frames / "train.npy"
    side = read_packed(packed).shape[1]
    known = frame_camera(packed) is not None
    training = TrainingConfig(
        samples_seen={},
        batch_size=options.batch,
        augmentation=ROTATIONS if known else AugmentationConfig(),
        device=options.device,
    )
    network = NetworkConfig(input_px=side, width=options.width, view="whole")
    for model in options.models:
        for seed in options.seeds:
            recipe = recipe_of(model)
            yield Job(model, network, recipe, training, 0, seed, FOR_PHOTOGRAPHS)


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu_errors", description=__doc__)
    parser.add_argument("frames", type=Path, help="directory of train.npy and test.npy")
    parser.add_argument("--labels", type=Path, required=True, help="of train.csv and test.csv")
    parser.add_argument("--models", nargs="+", default=["posenet2"], choices=MODELS)
    parser.add_argument("--device", default="cuda", choices=("cuda", "cpu"))
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="a run each")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--images", type=int, default=30_000, help="images shown (30000)")
    length.add_argument("--seconds", type=float, help="instead, seconds to train each run for")
    parser.add_argument("--width", type=float, default=SHIPPED_WIDTH, help="(0.25)")
    parser.add_argument("--batch", type=int, default=64, help="(64)")
    parser.add_argument("--out", type=Path, required=True, help="CSV to write")
    return parser


def run(options: argparse.Namespace) -> None:
    """Train, print, and write the table after every run."""
    rows = []
    for job in jobs_of(options):
        budget = Budget(options.images, options.seconds)
        rows.append(error_of(options.frames, options.labels, job, budget))
        write_frame(options.out, pd.DataFrame(rows), "%.5g")
        print(rows[-1], flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
