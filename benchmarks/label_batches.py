"""Errors of single batches of estimated labels, for comparing two versions of the code.

    python -m benchmarks.label_batches results/benchmarks/label_batches.csv --code after \
        --profile night --scene large_room --method sfm --batches 0 3 4

estimates batches of the training set that a profile's results hold, places each as if the batch
before it had ended at its true pose, and adds a row for each to a table. With ``PYTHONPATH`` set to
a checkout of another version the same frames are measured with that version's code. ``--set`` gives
SfM other settings than the profile's, and ``--made`` takes the estimates of the profile's run.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from baselines.config.labels import SfmConfig
from baselines.labels.batches import BatchTrajectory, batches_of, read_trajectory
from baselines.labels.chain import fill_gaps
from baselines.labels.kinect_fusion import kinect_fusion_batch
from baselines.labels.sfm import sfm_batch
from benchmarks.rows import read_rows
from reproduction.config.load import load_config
from reproduction.config.profile import Config
from synfeal.dataset.sevenscenes import read_pose
from synfeal.geometry.poses import pose_error, relative
from synfeal.records.provenance import seed_of
from synfeal.records.tables import write_frame

SPLIT, SIZE = "train", "6k"
Files = list[Path]


def frames_of(root: Path, config: Config, scene: str, index: int) -> tuple[Files, Files, Any]:
    """Return colour images, depth images and true poses (N, 4, 4) of a batch.

    Args:
        root: Results of the profile, with ``datasets/<scene>/estimation/seq-XX``.
        config: The profile.
        scene: Name of the scene.
        index: Number of the batch in the training set.
    """
    batch = batches_of(config.n_frames(scene, SIZE, SPLIT), config.estimation.batch_frames)[index]
    folder = root / "datasets" / scene / "estimation"
    places = [divmod(frame, config.shard_frames) for frame in range(batch.start, batch.stop)]
    stems = [
        folder / f"seq-{sequence + 1:02d}" / f"frame-{frame:06d}" for sequence, frame in places
    ]
    color, depth = ([s.with_suffix(f".{k}.png") for s in stems] for k in ("color", "depth"))
    return color, depth, np.array([read_pose(stem.with_suffix(".pose.txt")) for stem in stems])


def estimate(
    method: str, config: Config, scene: str, index: int, files: tuple[Files, Files, Any]
) -> tuple[BatchTrajectory, dict[str, Any], float]:
    """Estimate the poses of a batch.

    Args:
        method: ``sfm`` or ``kinect-fusion``.
        config: The profile.
        scene: Name of the scene.
        index: Number of the batch in the training set.
        files: Colour images, depth images and true poses, by :func:`frames_of`.

    Returns:
        The trajectory, facts about it, and the processor seconds it took.
    """
    color, depth, truth = files
    cfg, camera = config.estimation, config.estimation_camera
    began = time.process_time()
    if method == "sfm":
        seed = seed_of(config.seed, "sfm", scene, SIZE, SPLIT, f"{index:03d}")
        trajectory, facts = sfm_batch(color, camera, truth, cfg.sfm, seed)
        return trajectory, facts, time.process_time() - began
    kinect_fusion_batch(color[:2], depth[:2], camera, cfg.kinect_fusion)  # compiles
    began = time.process_time()
    trajectory = kinect_fusion_batch(color, depth, camera, cfg.kinect_fusion)
    return trajectory, {}, time.process_time() - began


def made(
    root: Path, method: str, scene: str, index: int
) -> tuple[BatchTrajectory, dict[str, Any], float]:
    """Read the estimate of a batch that a run has made, with facts and processor seconds."""
    stem = root / "estimates" / scene / SIZE / method / SPLIT / f"batch-{index:03d}"
    facts = json.loads(stem.with_suffix(".json").read_text())
    took_s = sum(value for name, value in facts.items() if name.endswith("_s"))
    return read_trajectory(stem.with_suffix(".csv")), facts, took_s


def with_settings(config: Config, given: Sequence[str]) -> Config:
    """Replace settings of SfM by those given as ``name=value``."""
    parts = (setting.partition("=") for setting in given)
    settings = {name: yaml.safe_load(value) for name, _, value in parts}
    sfm = SfmConfig.model_validate({**config.estimation.sfm.model_dump(), **settings})
    estimation = config.estimation.model_copy(update={"sfm": sfm})
    return config.model_copy(update={"estimation": estimation})


def errors_of(trajectory: BatchTrajectory, truth: Any) -> tuple[Any, Any]:
    """Return errors (N,), metres and radians, of a batch that starts at its true first pose.

    Args:
        trajectory: Estimate of the batch, whose gaps are filled as in chaining.
        truth: True poses (N, 4, 4).
    """
    return pose_error(fill_gaps(trajectory), relative(truth[0], truth))


def measured(trajectory: BatchTrajectory, truth: Any, config: Config) -> dict[str, Any]:
    """Compute the errors of a batch that starts at its true first pose, gaps filled as in chaining.

    Args:
        trajectory: Estimate of the batch.
        truth: True poses (N, 4, 4).
        config: Profile, for the thresholds of assistance.

    Returns:
        Numbers of a row, by column.
    """
    cfg = config.estimation
    error_m, error_rad = errors_of(trajectory, truth)
    error_deg = np.degrees(error_rad)
    found = trajectory.registered
    off = error_m[-1] > cfg.assist_position_m or error_deg[-1] > cfg.assist_orientation_deg
    return {
        "frames": len(found),
        "registered": int(found.sum()),
        "median_m": np.median(error_m),
        "registered_median_m": np.median(error_m[found]) if found.any() else np.nan,
        "rmse_m": np.sqrt(np.mean(error_m**2)),
        "max_m": error_m.max(),
        "last_m": error_m[-1],
        "median_deg": np.median(error_deg),
        "last_deg": error_deg[-1],
        "assisted": int(off or not found[0] or not found[1:].any()),
    }


def main() -> None:
    """Measure the batches that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--code", required=True, help="name of the version of the code")
    parser.add_argument("--profile", default="night")
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--scene", required=True)
    parser.add_argument("--method", choices=("sfm", "kinect-fusion"), required=True)
    parser.add_argument("--batches", type=int, nargs="+", required=True)
    parser.add_argument("--set", nargs="+", default=[], metavar="NAME=VALUE", dest="settings")
    parser.add_argument("--made", action="store_true")
    args = parser.parse_args()
    config = load_config(Path("config/config.yaml"), Path(f"config/{args.profile}.yaml"))
    config, root = with_settings(config, args.settings), args.results / args.profile
    for index in args.batches:
        files = frames_of(root, config, args.scene, index)
        if args.made:
            trajectory, facts, cpu_s = made(root, args.method, args.scene, index)
        else:
            trajectory, facts, cpu_s = estimate(args.method, config, args.scene, index, files)
        keys = {"scene": args.scene, "batch": index, "method": args.method, "code": args.code}
        row = {**keys, **measured(trajectory, files[2], config), "cpu_s": cpu_s}
        row |= {name: facts.get(name, "") for name in ("models", "images_with_weak_features")}
        rows = [pd.DataFrame([row])]
        if args.table.exists():
            rows.insert(0, read_rows(args.table))
        write_frame(args.table, pd.concat(rows).sort_values([*keys][:3], kind="stable"), "%.4g")
        print(row, flush=True)


if __name__ == "__main__":
    main()
