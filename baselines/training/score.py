"""Errors of predictions: against the labels a data set carries, and against the true poses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.labels.constant import constant_pose
from baselines.training.record import check_same_labels
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import HEADER, PoseTable, read_pose_table, whole_numbers
from synfeal.errors import InputError
from synfeal.evaluation.metrics import finite, pose_errors, summary
from synfeal.evaluation.reprojection import dcre, dcre_summary, read_cell_depth
from synfeal.records.files import write_json
from synfeal.records.tables import read_numbers, write_columns

Array = NDArray[np.float64]


def write_scores(
    predictions: Path,
    labels: Path,
    truth: Path,
    train_labels: Path,
    depth: Path,
    camera: CameraConfig,
    common: Path,
    common_truth: Path,
    wildcards: dict[str, str],
    out_errors: Path,
    out_metrics: Path,
    out_common_errors: Path,
) -> None:
    """Score a training run by :func:`score_run` and :func:`score_common`.

    Args:
        predictions: Predicted poses of the test frames.
        labels: Poses the test set carries.
        truth: True poses of the test frames.
        train_labels: Poses the training set carries, for scores of always answering the same.
        depth: Depths of the cells of the test frames.
        camera: Camera of the frames.
        common: Predicted poses of the test frames that all sizes share.
        common_truth: True poses of these.
        wildcards: Names of the run, which are copied into its metrics.
        out_errors: Errors of the test frames to write.
        out_metrics: Scores to write.
        out_common_errors: Errors of the shared test frames to write.
    """
    score_run(
        predictions=predictions,
        labels=labels,
        truth=truth,
        train_labels=train_labels,
        out_errors=out_errors,
        out_metrics=out_metrics,
        info=wildcards,
        depth=(depth, camera),
    )
    score_common(common, common_truth, out_common_errors)


def score_run(
    predictions: Path,
    labels: Path,
    truth: Path,
    train_labels: Path,
    out_errors: Path,
    out_metrics: Path,
    info: Mapping[str, Any],
    depth: tuple[Path, CameraConfig] | None = None,
) -> None:
    """Read predictions and what they are compared with, and score them by :func:`score_poses`.

    Args:
        predictions: Pose table of the test frames; may hold ``nan``.
        labels: The test split's labels.
        truth: The test split's true poses.
        train_labels: Labels that the run was trained on.
        out_errors: CSV to write, one row per frame.
        out_metrics: JSON to write.
        info: Further keys of the JSON, e.g. what the run was.
        depth: Depth that the test frames show, for the DCRE, and their camera.

    Raises:
        InputError: a file cannot be read, the tables are not about the same frames, or the labels
            are not those that the run was trained for.
    """
    check_same_labels(predictions.parent, labels)
    predicted = read_predictions(predictions)
    score_poses(
        predicted=predicted,
        labels=_read_like(labels, predicted),
        truth=_read_like(truth, predicted),
        train=read_pose_table(train_labels),
        out_errors=out_errors,
        out_metrics=out_metrics,
        info=info,
        depth=depth,
    )


def score_poses(
    predicted: PoseTable,
    labels: PoseTable,
    truth: PoseTable,
    train: PoseTable,
    out_errors: Path,
    out_metrics: Path,
    info: Mapping[str, Any],
    depth: tuple[Path, CameraConfig] | None = None,
) -> None:
    """Write the errors of every test frame, and what is printed of them.

    ``position_m`` and ``orientation_deg`` are against ``labels``, which is what the paper reports;
    the names ending in ``_true`` are against ``truth``. ``position_rms_m`` is the published code's
    definition, the root mean square over the three axes. ``baseline_*`` are the median errors of
    always answering the mean training pose, ``floor_*`` those of the true poses against ``labels``:
    what a perfect localizer scores. ``failed`` counts predictions that are no pose, i.e. not finite
    or without a unit quaternion; their error is infinite. Means and recalls are those of
    :func:`synfeal.evaluation.metrics.summary`, ``dcre`` that of
    :mod:`synfeal.evaluation.reprojection`. What is not finite is ``null`` in the JSON.

    Args:
        predicted: Predicted poses of the test frames; may hold ``nan``.
        labels: The test split's labels, of the same frames.
        truth: The test split's true poses, of the same frames.
        train: Labels that the run was trained on.
        out_errors: CSV to write, one row per frame.
        out_metrics: JSON to write.
        info: Further keys of the JSON, e.g. what the run was.
        depth: Depth that the test frames show, for the DCRE, and their camera.

    Raises:
        InputError: the depths cannot be read.
    """
    errors = _both_scores(predicted, labels, truth)
    constant = _both_scores(constant_pose(train, labels), labels, truth)
    floor = pose_errors(truth, labels)
    metrics: dict[str, Any] = {
        **info,
        **summary(errors, predicted.path),
        "position_rms_m": finite(float(np.median(errors["position_m"])) / math.sqrt(3)),
        "n_train": len(train),
        "n_test": len(predicted),
        "failed": int(np.isinf(errors["position_m"]).sum()),
        **{f"baseline_{name}": float(np.median(e)) for name, e in constant.items()},
        **{f"floor_{name}": float(np.median(e)) for name, e in floor.items()},
    }
    if depth:
        depth_m = read_cell_depth(depth[0], len(predicted))
        for end, reference in {"": labels, "_true": truth}.items():
            found = dcre(predicted, reference, depth_m, depth[1])
            metrics |= dcre_summary(found, predicted.path, end)
    write_columns(out_errors, {"frame": predicted.frame, **errors})
    write_json(out_metrics, metrics)


def score_common(predictions: Path, truth: Path, out: Path) -> None:
    """Write the errors on the common test set, against the true poses.

    Args:
        predictions: Predicted poses of some frames of the set; may hold ``nan``.
        truth: True poses of the whole set.
        out: CSV to write, one row per predicted frame.

    Raises:
        InputError: a file cannot be read, or the truth lacks frames of the predictions.
    """
    predicted, whole = read_predictions(predictions), read_pose_table(truth)
    poses = whole.at(np.flatnonzero(np.isin(whole.frame, predicted.frame)))
    if not np.array_equal(poses.frame, predicted.frame):
        raise InputError(predictions, f"has frames that {truth} does not have", "predict again")
    score_common_poses(predicted, poses, out)


def score_common_poses(predicted: PoseTable, truth: PoseTable, out: Path) -> None:
    """Write the errors on the common test set, against the true poses.

    Args:
        predicted: Predicted poses of some frames of the set; may hold ``nan``.
        truth: True poses of the same frames.
        out: CSV to write, one row per frame.
    """
    write_columns(out, {"frame": predicted.frame, **pose_errors(predicted, truth)})


def _both_scores(poses: PoseTable, labels: PoseTable, truth: PoseTable) -> dict[str, Array]:
    """Compute errors (N,) against the labels, and, under names in ``_true``, against the truth."""
    true = {f"{name}_true": e for name, e in pose_errors(poses, truth).items()}
    return pose_errors(poses, labels) | true


def read_predictions(path: Path) -> PoseTable:
    """Read a pose table whose poses may be ``nan``, unlike labels.

    Raises:
        InputError: The file is missing or damaged, or has no rows.
    """
    values = read_numbers(path, HEADER, "table of predictions", finite=False)
    if not len(values):
        raise InputError(path, "has no rows", "predict again")
    frame, straight_path = whole_numbers(values[:, :2], path).T
    return PoseTable(frame, straight_path, values[:, 2:5], values[:, 5:9])


def _read_like(path: Path, predicted: PoseTable) -> PoseTable:
    table = read_pose_table(path)
    if not np.array_equal(table.frame, predicted.frame):
        raise InputError(
            path,
            f"its frames are not those of predictions.csv ({len(table)} and {len(predicted)} rows)",
            "predict again for these labels",
        )
    return table
