"""From the trajectories of all batches to the label set of a data set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from baselines.groundtruth.batches import batches_of
from baselines.groundtruth.chain import Assistance, chain_batches, chain_unassisted
from baselines.groundtruth.trajectory import read_trajectory
from synfeal.config.models import GroundTruthConfig
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.files import write_json


def chain_split(
    trajectories: Sequence[Path],
    truth: Path,
    labels: Path,
    unassisted: Path,
    cfg: GroundTruthConfig,
) -> Assistance:
    """Chain the batches of one split, and return its record of assistance.

    Args:
        trajectories: files of its batches, in order.
        truth: its true poses.
        labels: where its labels are written.
        unassisted: where the labels are written that it would have without assistance.
        cfg: frames per batch, and the two thresholds.

    Raises:
        InputError: a file cannot be read, or a trajectory is not of its batch.
    """
    true_table = read_pose_table(truth)
    batches = batches_of(len(true_table), cfg.batch_frames)
    estimates = [read_trajectory(path) for path in trajectories]
    for path, estimate, batch in zip(trajectories, estimates, batches, strict=True):
        if len(estimate) != len(batch):
            raise InputError(
                f"{path}: holds {len(estimate)} poses for {len(batch)} frames; estimate it again"
            )
    table, assistance = chain_batches(batches, estimates, true_table, cfg)
    write_pose_table(labels, table)
    write_pose_table(unassisted, chain_unassisted(batches, estimates, true_table))
    return assistance


def write_assistance(path: Path, method: str, splits: Mapping[str, Assistance]) -> None:
    """Write the records of all splits of one method as JSON."""
    records = {split: assistance.to_json() for split, assistance in splits.items()}
    write_json(path, {"method": method, "splits": records})
