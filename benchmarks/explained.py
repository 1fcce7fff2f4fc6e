"""Set the share of matched points that an SfM model explains beside the model's error.

    python -m benchmarks.explained results/benchmarks/explained.csv \
        --config config/replication.yaml --runs replication_101 replication_102

reads the models of finished runs, as they were made: nothing is estimated anew. A row for each
batch of the training set has the share, and the errors of the batch placed as if the batch before
it had ended at its true pose. The mapper starts again where the share is below
``estimation.sfm.min_explained``; the table shows which batches another limit would concern. Rows of
other runs stay in it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from baselines.labels.batches import batches_of
from benchmarks.label_batches import SIZE, SPLIT, made, measured
from benchmarks.rows import read_rows
from reproduction.config.load import load_config
from reproduction.config.profile import Config
from synfeal.dataset.pose_table import read_pose_table
from synfeal.records.tables import write_frame

COLUMNS = ("median_m", "rmse_m", "last_m", "last_deg", "registered", "assisted")


def batch_rows(results: Path, profile: str, config: Config) -> Iterator[dict[str, Any]]:
    """Yield a row for each batch that a run has an SfM model of.

    Args:
        results: Folder of the results of all profiles.
        profile: Name of the run's folder.
        config: Its configuration.
    """
    root = results / profile
    for folder in sorted((root / "estimates").glob(f"*/{SIZE}/sfm/{SPLIT}")):
        scene = folder.parents[2].name
        poses = read_pose_table(root / "labels" / scene / SIZE / "synfeal" / f"{SPLIT}.csv")
        count = config.n_frames(scene, SIZE, SPLIT)
        for batch in batches_of(count, config.estimation.batch_frames):
            trajectory, facts, cpu_s = made(root, "sfm", scene, batch.index)
            truth = poses.world_from_cam[batch.start : batch.stop]
            errors = measured(trajectory, truth, config)
            keys = {"profile": profile, "scene": scene, "batch": batch.index}
            shares = {name: facts[name] for name in ("explained", "starts")}
            yield {**keys, **shares, **{name: errors[name] for name in COLUMNS}, "cpu_s": cpu_s}


def main() -> None:
    """Collect the batches of the runs that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--config", type=Path, required=True, help="profile of the runs")
    parser.add_argument("--runs", nargs="+", required=True, help="their folders in RESULTS")
    args = parser.parse_args()
    config = load_config(Path("config/config.yaml"), args.config)
    before = read_rows(args.table, ("profile", "scene"))
    rows = [row for run in args.runs for row in batch_rows(args.results, run, config)]
    others = before[~before["profile"].isin(args.runs)]
    write_frame(args.table, pd.concat([others, pd.DataFrame(rows)]), "%.4g")


if __name__ == "__main__":
    main()
