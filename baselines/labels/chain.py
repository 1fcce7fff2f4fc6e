"""Chaining batches to one trajectory, with the assistance of section 4.1.

A batch starts at the label its first frame got from the batch before, ``world_from_last``, and its
poses follow as ``world_from_last @ first_from_cam``. After each batch the last pose is compared
with the true one. When it is off by more than the thresholds it alone is replaced by the true pose,
the batch counts as assisted, and the next batch starts from the replaced pose.

A method whose gauge is fitted to several true poses of every batch has a place in the world, and
to move it to where the batch before ended would throw that away. Such batches are *anchored*: they
follow as ``true_world_from_first @ first_from_cam``, and the error of one is not carried to the
next. Their last poses are compared and replaced as those of others.

Frames that a method did not register are filled in. Between two registered frames the motion is
interpolated (straight line, constant angular velocity); after the last one its pose is held. The
first frame always counts as known, since it is shared with the batch before. Labels say which
frames were registered: nothing is trained on the others.

A batch whose first frame was not registered is assisted whatever its error: where its first
registered frame stands was taken from the true poses (``sfm/batch.py``).

A batch with no registered frame besides the first is lost. It is assisted whatever its error, and
its frames are interpolated between its start and the true last pose, so that no frame is ever
dropped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.config.labels import EstimationConfig
from baselines.labels.batches import Batch, BatchTrajectory, batches_of, read_trajectory
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.geometry.poses import interpolate, pose_error
from synfeal.records.files import write_json

Array = NDArray[np.float64]


class TruthUsed(StrEnum):
    """True poses that place and scale every batch, beside those that assistance replaces."""

    NOTHING = "none"  # metric, and chained from the true first pose of the split
    CAMERA = "first pose and 44 distances"
    POSES = "first 44 poses"


@dataclass(frozen=True)
class BatchRecord:
    """Record of one batch; errors are those of its last pose against the true one.

    Attributes:
        index: Position of the batch in its split.
        start: First frame.
        stop: One past the last frame.
        registered: Frames whose pose the method found.
        filled: Frames whose label was interpolated or held.
        lost: The method found no motion at all.
        assisted: The last pose was replaced by the true one.
        error_before_m: Position error before assistance (of a lost batch: of standing still).
        error_before_deg: Orientation error before assistance.
        error_after_m: Position error the next batch starts with.
        error_after_deg: Orientation error the next batch starts with.
    """

    index: int
    start: int
    stop: int
    registered: int
    filled: int
    lost: bool
    assisted: bool
    error_before_m: float
    error_before_deg: float
    error_after_m: float
    error_after_deg: float


def summary_of(records: Sequence[BatchRecord]) -> dict[str, Any]:
    """Summarise a split: totals and one record per batch, as plain values."""
    return {
        "batches": len(records),
        "assisted": sum(record.assisted for record in records),
        "lost": sum(record.lost for record in records),
        "filled_frames": sum(record.filled for record in records),
        "records": [asdict(record) for record in records],
    }


def chain_batches(
    batches: Sequence[Batch],
    trajectories: Sequence[BatchTrajectory],
    truth: PoseTable,
    cfg: EstimationConfig,
    anchored: bool = False,
) -> tuple[PoseTable, list[BatchRecord]]:
    """Compute the labels of a whole split from its batches, and what assistance they needed.

    Args:
        batches: All batches of the split in order, from ``batches_of(len(truth), ...)``.
        trajectories: One estimate per batch.
        truth: True poses of the split; the first one anchors the chain.
        cfg: The two thresholds.
        anchored: Batches have a place of their own instead of starting at the last label.

    Returns:
        The labels (frames and paths of ``truth``, other poses) and a record per batch.

    Raises:
        ValueError: batches, trajectories and truth do not fit together.
    """
    _check(batches, trajectories, len(truth))
    true_world_from_cam = truth.world_from_cam
    labels = true_world_from_cam.copy()
    records = []
    for batch, trajectory in zip(batches, trajectories, strict=True):
        start = labels[batch.start].copy()
        labels[batch.start : batch.stop], record = _place(
            batch,
            trajectory,
            world_from_first=start,
            world_from_batch=true_world_from_cam[batch.start] if anchored else start,
            true_world_from_last=true_world_from_cam[batch.stop - 1],
            cfg=cfg,
        )
        records.append(record)
    return _labels(truth, labels, batches, trajectories), records


def _labels(
    truth: PoseTable,
    world_from_cam: Array,
    batches: Sequence[Batch],
    trajectories: Sequence[BatchTrajectory],
) -> PoseTable:
    """Label the frames of ``truth`` with other poses, and say which of them were estimated.

    A frame that two batches share is that of the earlier one. The first of all is given.
    """
    registered = np.ones(len(truth), dtype=bool)
    for batch, trajectory in zip(batches, trajectories, strict=True):
        registered[batch.start + 1 : batch.stop] = trajectory.registered[1:]
    return replace(truth.with_poses(world_from_cam), registered=registered)


def chain_unassisted(
    batches: Sequence[Batch],
    trajectories: Sequence[BatchTrajectory],
    truth: PoseTable,
    anchored: bool = False,
) -> PoseTable:
    """Chain batches without assistance: no pose is replaced, a lost batch stands still.

    Arguments and errors are those of :func:`chain_batches`.
    """
    _check(batches, trajectories, len(truth))
    labels = truth.world_from_cam.copy()
    for batch, trajectory in zip(batches, trajectories, strict=True):
        world_from_first = labels[batch.start].copy()
        world_from_batch = truth.world_from_cam[batch.start] if anchored else world_from_first
        labels[batch.start : batch.stop] = world_from_batch @ fill_gaps(trajectory)
        labels[batch.start] = world_from_first
    return _labels(truth, labels, batches, trajectories)


def fill_gaps(trajectory: BatchTrajectory) -> Array:
    """Return poses (n, 4, 4) of all frames: interpolated between known ones, held after the last.

    The first frame is the identity by definition, registered or not.
    """
    poses = trajectory.first_from_cam.copy()
    poses[0] = np.eye(4)
    known = np.flatnonzero(trajectory.registered | (np.arange(len(poses)) == 0))
    for before, after in pairwise(known.tolist()):
        gap = np.arange(before + 1, after)
        if len(gap):
            fraction = (gap - before) / (after - before)
            poses[gap] = interpolate(poses[before], poses[after], fraction)
    poses[known[-1] + 1 :] = poses[known[-1]]
    return poses


def _place(
    batch: Batch,
    trajectory: BatchTrajectory,
    world_from_first: Array,
    world_from_batch: Array,
    true_world_from_last: Array,
    cfg: EstimationConfig,
) -> tuple[Array, BatchRecord]:
    """Place one batch in the world and assist it where needed.

    Args:
        batch: The batch.
        trajectory: Its estimate.
        world_from_first: Label (4, 4) of the first frame.
        world_from_batch: Pose (4, 4) that ``first_from_cam`` is relative to.
        true_world_from_last: True pose (4, 4) of the last frame.
        cfg: The two thresholds.

    Returns:
        Labels (n, 4, 4) of the batch's frames, and its record.
    """
    lost = not trajectory.registered[1:].any()
    poses = world_from_batch @ fill_gaps(trajectory)
    before_m, before_deg = _error(poses[-1], true_world_from_last)
    off = before_m > cfg.assist_position_m or before_deg > cfg.assist_orientation_deg
    assisted = lost or off or not trajectory.registered[0]
    if lost:
        poses = interpolate(world_from_first, true_world_from_last, np.linspace(0, 1, len(batch)))
    if assisted:
        poses[-1] = true_world_from_last
    poses[0] = world_from_first
    after_m, after_deg = _error(poses[-1], true_world_from_last)
    return poses, BatchRecord(
        index=batch.index,
        start=batch.start,
        stop=batch.stop,
        registered=int(trajectory.registered.sum()),
        filled=int((~trajectory.registered[1:]).sum()),
        lost=bool(lost),
        assisted=bool(assisted),
        error_before_m=before_m,
        error_before_deg=before_deg,
        error_after_m=after_m,
        error_after_deg=after_deg,
    )


def _error(pose: Array, true_pose: Array) -> tuple[float, float]:
    """Compute the position error in metres and the orientation error in degrees of one pose."""
    position_m, orientation_rad = pose_error(pose, true_pose)
    return float(position_m), float(np.degrees(orientation_rad))


def _check(
    batches: Sequence[Batch], trajectories: Sequence[BatchTrajectory], n_frames: int
) -> None:
    """Refuse batches that do not cover the split in order, or estimates of other lengths."""
    if len(batches) != len(trajectories):
        raise ValueError(f"{len(batches)} batches but {len(trajectories)} trajectories")
    expected = 0
    for batch, trajectory in zip(batches, trajectories, strict=True):
        if batch.start != expected:
            raise ValueError(f"batch {batch.index} starts at {batch.start}, not at {expected}")
        if len(batch) != len(trajectory):
            raise ValueError(f"batch {batch.index}: {len(trajectory)} poses, {len(batch)} frames")
        expected = batch.stop - 1
    if expected != n_frames - 1:
        raise ValueError(f"the batches end at frame {expected}, the split at {n_frames - 1}")


def write_label_set(
    reconstructed: str,
    train_batches: Sequence[Path],
    test_batches: Sequence[Path],
    train_truth: Path,
    test_truth: Path,
    estimation: EstimationConfig,
    truth_used: TruthUsed,
    parameters: dict[str, Any],
    out_train: Path,
    out_test: Path,
    out_train_unassisted: Path,
    out_test_unassisted: Path,
    out_assistance: Path,
    out_record: Path,
) -> None:
    """Chain the batches of both splits into a label set, and record how it was made.

    Args:
        reconstructed: Name of the label method.
        train_batches: Trajectories of the training batches, in order.
        test_batches: Trajectories of the test batches, in order.
        train_truth: Pose table with the true training poses.
        test_truth: Pose table with the true test poses.
        estimation: Frames per batch, and the thresholds of assistance.
        truth_used: True poses the method itself used; batches placed by ``POSES`` are anchored.
        parameters: Settings the labels depend on, written to ``out_record`` as they are.
        out_train: Pose table of the training labels.
        out_test: Pose table of the test labels.
        out_train_unassisted: The training labels as they would be without assistance.
        out_test_unassisted: The test labels as they would be without assistance.
        out_assistance: JSON with a record per batch; see :func:`write_assistance`.
        out_record: JSON with ``parameters`` under their name.

    Raises:
        InputError: a file cannot be read, or a trajectory does not fit its batch.
    """
    anchored = truth_used == TruthUsed.POSES
    records = {
        "train": chain_split(
            trajectories=train_batches,
            truth=train_truth,
            labels=out_train,
            unassisted=out_train_unassisted,
            cfg=estimation,
            anchored=anchored,
        ),
        "test": chain_split(
            trajectories=test_batches,
            truth=test_truth,
            labels=out_test,
            unassisted=out_test_unassisted,
            cfg=estimation,
            anchored=anchored,
        ),
    }
    write_assistance(out_assistance, reconstructed, records, truth_used)
    write_json(out_record, {"parameters": parameters})


def chain_split(
    trajectories: Sequence[Path],
    truth: Path,
    labels: Path,
    unassisted: Path,
    cfg: EstimationConfig,
    anchored: bool = False,
) -> list[BatchRecord]:
    """Chain the batches of one split, and return a record per batch.

    Args:
        trajectories: Files of its batches, in order.
        truth: Its true poses.
        labels: Pose table to write: its labels.
        unassisted: Pose table to write: the labels that it would have without assistance.
        cfg: Frames per batch, and the two thresholds.
        anchored: Batches have a place of their own; see :func:`chain_batches`.

    Raises:
        InputError: a file cannot be read, or a trajectory is not of its batch.
    """
    true_table = read_pose_table(truth)
    batches = batches_of(len(true_table), cfg.batch_frames)
    estimates = [read_trajectory(path) for path in trajectories]
    for path, estimate, batch in zip(trajectories, estimates, batches, strict=True):
        if len(estimate) != len(batch):
            raise InputError(
                path, f"holds {len(estimate)} poses for {len(batch)} frames", "estimate it again"
            )
    table, assistance = chain_batches(batches, estimates, true_table, cfg, anchored)
    write_pose_table(labels, table)
    write_pose_table(unassisted, chain_unassisted(batches, estimates, true_table, anchored))
    return assistance


def write_assistance(
    path: Path,
    method: str,
    splits: Mapping[str, list[BatchRecord]],
    truth_used: TruthUsed = TruthUsed.NOTHING,
) -> None:
    """Write what assistance each batch of a method needed, as JSON.

    Args:
        path: File to write.
        method: Name of the label method.
        splits: Records of the batches, in order, by split (``train``, ``test``).
        truth_used: True poses the method used beside those that assistance put in.
    """
    summaries = {split: summary_of(records) for split, records in splits.items()}
    write_json(path, {"method": method, "truth_used": truth_used, "splits": summaries})
