"""From the trajectories of all batches to the label set of a data set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from baselines.groundtruth.batches import batches_of
from baselines.groundtruth.chain import BatchRecord, chain_batches, chain_unassisted, summary_of
from baselines.groundtruth.trajectory import read_trajectory
from synfeal.config.models import GroundTruthConfig
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.files import write_json


def write_label_set(
    reconstructed: str,
    train_batches: Sequence[Path],
    test_batches: Sequence[Path],
    train_truth: Path,
    test_truth: Path,
    groundtruth: GroundTruthConfig,
    estimation: dict[str, Any],
    out_train: Path,
    out_test: Path,
    out_train_unassisted: Path,
    out_test_unassisted: Path,
    out_assistance: Path,
    out_record: Path,
) -> None:
    """Chain both splits; ``estimation`` is what the record says that the labels depend on."""
    train = train_truth, out_train, out_train_unassisted
    test = test_truth, out_test, out_test_unassisted
    records = {
        "train": chain_split(train_batches, *train, groundtruth),
        "test": chain_split(test_batches, *test, groundtruth),
    }
    write_assistance(out_assistance, reconstructed, records)
    write_json(out_record, {"parameters": estimation})


def chain_split(
    trajectories: Sequence[Path],  # files of its batches, in order
    truth: Path,  # its true poses
    labels: Path,  # where its labels are written
    unassisted: Path,  # where the labels are written that it would have without assistance
    cfg: GroundTruthConfig,  # frames per batch, and the two thresholds
) -> list[BatchRecord]:
    """Chain the batches of one split, and return a record per batch.

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


def write_assistance(path: Path, method: str, splits: Mapping[str, list[BatchRecord]]) -> None:
    """Write the records of all splits of one method as JSON."""
    write_json(path, {"method": method, "splits": {s: summary_of(r) for s, r in splits.items()}})
