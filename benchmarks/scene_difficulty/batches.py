"""What the reconstructed batches are worth: errors, and how often they need assistance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from baselines.groundtruth.batches import Batch, batches_of
from baselines.groundtruth.chain import chain_batches, fill_gaps
from baselines.groundtruth.trajectory import BatchTrajectory
from synfeal.config.models import GroundTruthConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error, relative
from synfeal.report.assistance import PUBLISHED_ASSISTED
from synfeal.report.published import published_cells
from synfeal.report.tables import Value

BATCH_COLUMNS = (
    "scene",
    "method",
    "batch",
    "frames",
    "registered",
    "filled",
    "ate_median_m",
    "ate_max_m",
    "last_error_m",
    "last_error_deg",
    "assisted",
    "cpu_s",
)


def batch_rows(
    scene: str,
    method: str,
    batches: Sequence[Batch],
    trajectories: Sequence[BatchTrajectory],
    truth: PoseTable,
    cfg: GroundTruthConfig,
    cpu_s: Sequence[float],
) -> list[dict[str, Value]]:
    """One row per batch.

    ``ate_*`` are position errors of all frames when the batch starts at its true first pose, gaps
    filled. ``last_error_*`` are those of the last pose when the batch starts where the batch before
    left it, before assistance: what decides about assistance.
    """
    _, assistance = chain_batches(batches, trajectories, truth, cfg)
    rows: list[dict[str, Value]] = []
    for batch, estimate, record, seconds in zip(
        batches, trajectories, assistance.records, cpu_s, strict=True
    ):
        error_m = absolute_error_m(estimate, truth.between(batch.start, batch.stop))
        rows.append(
            {
                "scene": scene,
                "method": method,
                "batch": batch.index,
                "frames": len(batch),
                "registered": record.registered,
                "filled": record.filled,
                "ate_median_m": float(np.median(error_m)),
                "ate_max_m": float(error_m.max()),
                "last_error_m": record.error_before_m,
                "last_error_deg": record.error_before_deg,
                "assisted": int(record.assisted),
                "cpu_s": seconds,
            }
        )
    return rows


def absolute_error_m(estimate: BatchTrajectory, truth: PoseTable) -> np.ndarray:
    """Position errors (n,) of a batch that starts at its true first pose, gaps filled."""
    true_world_from_cam = truth.world_from_cam
    true_first_from_cam = relative(true_world_from_cam[0], true_world_from_cam)
    return pose_error(fill_gaps(estimate), true_first_from_cam)[0]


def assistance_summary(rows: Sequence[dict[str, Value]], batch_frames: int) -> dict[str, Value]:
    """The rows of one method in one, beside what the paper counted."""
    method = str(rows[0]["method"])
    return {
        "scene": rows[0]["scene"],
        "method": method,
        "batches": len(rows),
        "assisted": int(_values(rows, "assisted").sum()),
        "frames": int(_values(rows, "frames").sum()),
        "filled": int(_values(rows, "filled").sum()),
        "ate_median_m_median": float(np.median(_values(rows, "ate_median_m"))),
        "ate_max_m_max": float(_values(rows, "ate_max_m").max()),
        "cpu_s_mean": float(_values(rows, "cpu_s").mean()),
        "published_assisted": PUBLISHED_ASSISTED[method],
        "published_batches": published_batches(method, batch_frames),
    }


def published_batches(method: str, batch_frames: int) -> int:
    """Batches in the data set of table 2 that the method labelled, training and test split."""
    cells = published_cells("table2_ground_truth")
    cell = next(cell for key, cell in cells.items() if key[3] == method)
    return sum(len(batches_of(count, batch_frames)) for count in (cell.n_train, cell.n_test))


def _values(rows: Sequence[dict[str, Value]], name: str) -> np.ndarray:
    return np.array([row[name] for row in rows], np.float64)
