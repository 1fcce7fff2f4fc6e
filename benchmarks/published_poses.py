"""Score poses that others published of 7-Scenes RedKitchen, by both sources of labels.

    python -m benchmarks.published_poses results/benchmarks/published_poses.csv \
        path/to/visloc_pseudo_gt_limitations

The repository `tsattler/visloc_pseudo_gt_limitations` (Brachmann et al., ICCV 2021) has the poses
that each method found for the test sequences, and the labels by structure from motion (SfM) and by
depth SLAM.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

import synfeal
from synfeal.records.tables import write_frame

LABELS = ("sfm", "dslam")
METHODS = ("hloc", "as", "dsac_rgb", "dsac_rgbd", "r2d2_rgb", "r2d2_rgbd")
SCENE = "redkitchen"
SCORES = ("position_m", "orientation_deg", "recall_5cm_5deg")


def main() -> None:
    """Write a row for each source of labels and method."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("repository", type=Path)
    given = parser.parse_args()
    rows = []
    for labels in LABELS:
        truth = given.repository / f"pgt/{labels}/7scenes/{SCENE}_test.txt"
        for method in METHODS:
            poses = given.repository / f"estimates/{labels}/7scenes/{SCENE}_{method}.txt"
            found = synfeal.evaluate(truth, poses)
            rows.append(
                {
                    "labels": labels,
                    "method": method,
                    **{name: found.metrics[name] for name in SCORES},
                    "n_test": len(found.errors["position_m"]),
                }
            )
    write_frame(given.table, pd.DataFrame(rows))


if __name__ == "__main__":
    main()
