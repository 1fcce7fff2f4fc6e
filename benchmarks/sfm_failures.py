"""Batches that SfM folded in a replication, mapped again by COLMAP as it comes.

    python -m benchmarks.sfm_failures results/benchmarks/sfm_failures.csv --seed 103 --batches 0

asks whether a failure is the method's or that of our settings. COLMAP gets all pairs of images, its
own thresholds and the true intrinsics. Both models are compared with the true poses after one
similarity transformation, so that no choice of scale or place has a part in it. Needs the results
of the replication, and adds two rows to a table.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pycolmap
from numpy.typing import NDArray

from baselines.config.labels import SfmConfig
from baselines.labels.alignment import fit
from baselines.labels.batches import link_images, read_trajectory
from baselines.labels.sfm.features import extract_features
from baselines.labels.sfm.mapping import camera_poses
from benchmarks.label_batches import SIZE, SPLIT, frames_of
from benchmarks.rows import read_rows
from reproduction.config.load import load_config
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import position_error_m
from synfeal.records.tables import write_frame

SCENE = "large_room"
OURS, DEFAULTS = "ours", "COLMAP's defaults, all pairs"
Array = NDArray[np.float64]


def map_by_defaults(
    color: Sequence[Path], camera: CameraConfig
) -> tuple[NDArray[np.int64], Array, int]:
    """Map images with COLMAP's own settings, each image matched with all others.

    Args:
        color: Images in the order of the batch.
        camera: Their true camera, which stays as it is.

    Returns:
        Frames (m,) that the largest model registers, their ``model_from_cam`` (m, 4, 4), and the
        number of models.
    """
    with tempfile.TemporaryDirectory() as folder:
        images, database = Path(folder, "images"), Path(folder, "database.db")
        link_images(color, camera, images)
        sift = pycolmap.SiftExtractionOptions()
        cfg = SfmConfig(
            max_features=sift.max_num_features, peak_threshold=sift.peak_threshold, few_features=0
        )
        extract_features(images, database, camera, cfg)
        matching = pycolmap.FeatureMatchingOptions(num_threads=1, use_gpu=False)
        pycolmap.match_exhaustive(database, matching, device=pycolmap.Device.cpu)
        options = pycolmap.IncrementalPipelineOptions(
            num_threads=1,
            random_seed=0,
            extract_colors=False,
            ba_refine_focal_length=False,
            ba_refine_principal_point=False,
            ba_refine_extra_params=False,
        )
        models = pycolmap.incremental_mapping(database, images, folder, options)
        largest = max(models.values(), key=lambda model: int(model.num_reg_images()), default=None)
        return *camera_poses(largest), len(models)


def measured(frames: NDArray[np.int64], poses: Array, truth: Array) -> dict[str, Any]:
    """Compare registered poses with the true ones after the best similarity transformation.

    Args:
        frames: Registered frames (m,) of the batch.
        poses: Their poses (m, 4, 4) in the model.
        truth: ``world_from_cam`` (N, 4, 4) of all frames of the batch.
    """
    row: dict[str, Any] = {"frames": len(truth), "registered": len(frames)}
    if len(frames) < 2:
        return row
    placed = fit(poses, truth[frames], "similarity").place(poses)
    error_m = position_error_m(placed[:, :3, 3], truth[frames, :3, 3])
    return row | {"median_m": np.median(error_m), "max_m": error_m.max()}


def main() -> None:
    """Measure the batches that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--batches", type=int, nargs="+", required=True)
    parser.add_argument("--results", type=Path, default=Path("results"))
    args = parser.parse_args()
    pycolmap.logging.minloglevel = pycolmap.logging.Level.WARNING.value
    config = load_config(Path("config/config.yaml"), Path("config/replication.yaml"))
    root = args.results / f"replication_{args.seed}"
    for index in args.batches:
        color, _, truth = frames_of(root, config, SCENE, index)
        name = f"{SCENE}/{SIZE}/sfm/{SPLIT}/batch-{index:03d}.csv"
        made = read_trajectory(root / "estimates" / name)
        found = np.flatnonzero(made.registered)
        rows = [{"mapping": OURS, **measured(found, made.first_from_cam[found], truth)}]
        began = time.process_time()
        frames, poses, models = map_by_defaults(color, config.estimation_camera)
        took_s = time.process_time() - began
        others = {"mapping": DEFAULTS, **measured(frames, poses, truth)}
        rows.append({**others, "models": models, "cpu_s": took_s})
        table = pd.DataFrame(rows)
        table.insert(0, "seed", args.seed)
        table.insert(1, "batch", index)
        if args.table.exists():
            table = pd.concat([read_rows(args.table), table])
        write_frame(args.table, table, "%.4g")
        print(table.tail(2).to_string(), flush=True)


if __name__ == "__main__":
    main()
