r"""Errors of localizers trained on a GPU beside those of the same runs on a processor.

    python -m benchmarks.gpu_errors results/night/frames/large_room \
        --labels results/night/labels/large_room/6k/synfeal --devices cuda cpu --out errors.csv

Every seed is trained on every device as ``synfeal train`` trains, and predicts the same test
frames. Networks have the side of the packed frames.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
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
from baselines.training.run import Job, train_localizer
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


def error_of(
    frames: Path, labels: Path, model: str, device: str, seed: int, options: argparse.Namespace
) -> ErrorRow:
    """Train one localizer, and compare its predictions with the labels of the test frames.

    Args:
        frames: Directory of ``train.npy`` and ``test.npy``.
        labels: Directory of ``train.csv`` and ``test.csv``.
        model: Name of the localizer.
        device: Device to train on.
        seed: Seed of the run.
        options: Width, batch and length, as :func:`build_parser` reads them.
    """
    side = read_packed(frames / "train.npy").shape[1]
    network = NetworkConfig(input_px=side, width=options.width, view="whole")
    known = frame_camera(frames / "train.npy") is not None
    training = TrainingConfig(
        samples_seen={},
        batch_size=options.batch,
        augmentation=ROTATIONS if known else AugmentationConfig(),
        device=device,
    )
    job = Job(model, network, recipe_of(model), training, options.images, seed, FOR_PHOTOGRAPHS)
    shipped = options.width == SHIPPED_WIDTH
    weights = shipped_weights_path(backbone_of(model, network)) if shipped else None
    with tempfile.TemporaryDirectory() as folder:
        out, began = Path(folder), time.perf_counter()
        trained = train_localizer(
            job,
            frames / "train.npy",
            labels / "train.csv",
            out / "model.pt",
            out / "history.csv",
            weights=weights,
        )
        seconds = time.perf_counter() - began
        poses = write_predictions(
            trained.localizer, frames / "test.npy", labels / "test.csv", out / "predictions.csv"
        )
    shift_m = poses.predicted.position_m - poses.given.position_m
    angle_rad = rotation_angle_rad(poses.predicted.quat_wxyz, poses.given.quat_wxyz)
    return ErrorRow(
        localizer=model,
        input_px=side,
        width=options.width,
        batch=options.batch,
        images=options.images,
        device=device,
        seed=seed,
        position_m=float(np.median(np.linalg.norm(shift_m, axis=1))),
        orientation_deg=float(np.degrees(np.median(angle_rad))),
        seconds=seconds,
    )


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu_errors", description=__doc__)
    parser.add_argument("frames", type=Path, help="directory of train.npy and test.npy")
    parser.add_argument("--labels", type=Path, required=True, help="of train.csv and test.csv")
    parser.add_argument("--models", nargs="+", default=["posenet2"], choices=MODELS)
    parser.add_argument("--devices", nargs="+", default=["cuda", "cpu"], choices=("cuda", "cpu"))
    parser.add_argument("--seeds", type=int, default=3, help="runs of each (3)")
    parser.add_argument("--images", type=int, default=30_000, help="images shown (30000)")
    parser.add_argument("--width", type=float, default=SHIPPED_WIDTH, help="(0.25)")
    parser.add_argument("--batch", type=int, default=64, help="(64)")
    parser.add_argument("--out", type=Path, required=True, help="CSV to write")
    return parser


def run(options: argparse.Namespace) -> None:
    """Train, print, and write the table after every run."""
    rows = []
    for model in options.models:
        for device in options.devices:
            for seed in range(options.seeds):
                rows.append(error_of(options.frames, options.labels, model, device, seed, options))
                write_frame(options.out, pd.DataFrame(rows), "%.5g")
                print(rows[-1], flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
