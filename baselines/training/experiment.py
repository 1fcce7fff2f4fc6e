"""A training run of the workflow: train, predict, and score in one process.

A process that scores one run and nothing else spends its time on imports. So scores are written
where predictions are made, of the poses in memory; those of an archive's predictions are written by
:func:`baselines.training.score.write_scores` alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from baselines.config.learning import ModelName
from baselines.training.run import train_and_predict
from baselines.training.score import score_common_poses, score_poses
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.evaluation.reprojection import read_cell_depth


def train_and_score(
    model: ModelName,
    frames: Path,
    labels: Path,
    test_frames: Path,
    test_labels: Path,
    run: dict[str, Any],
    truth: Path,
    depth: Path,
    camera: CameraConfig,
    common: Path,
    every: int,
    wildcards: dict[str, str],
    out_model: Path,
    out_history: Path,
    out_record: Path,
    out_predictions: Path,
    out_common: Path,
    out_errors: Path | None = None,
    out_common_errors: Path | None = None,
    out_metrics: Path | None = None,
    weights: Path | None = None,
) -> None:
    """Train a localizer, predict its test frames, and score the predictions.

    Everything that scoring will read is checked before training: no run is lost to a file that
    could have been found missing or damaged at once.

    Args:
        model: Name of the localizer.
        frames: Packed training frames.
        labels: Poses of the training frames, as the data set labels them.
        test_frames: Packed test frames.
        test_labels: Poses of the test frames, as the data set labels them.
        run: Settings of the run; see :func:`reproduction.design.runs.training_parameters`.
        truth: True poses of the test frames.
        depth: Depth that the test frames show, for the reprojection error.
        camera: Camera of the frames, for the reprojection error.
        common: True poses of the common test set.
        every: Predict the first of each so many frames of the common test set.
        wildcards: Names of the run, which are copied into its metrics.
        out_model: Checkpoint to write.
        out_history: CSV of the losses to write.
        out_record: Record to write of what the run was trained from.
        out_predictions: Predicted poses of the test frames to write.
        out_common: Predicted poses of the common test set to write.
        out_errors: Errors of the test frames to write; None scores nothing.
        out_common_errors: Errors on the common test set to write.
        out_metrics: Scores to write.
        weights: State dict that the backbone starts from; None trains from scratch.

    Raises:
        InputError: a file cannot be used.
    """
    true = read_scorable(test_labels, truth, depth) if out_errors else None
    test, on_common = train_and_predict(
        model=model,
        frames=frames,
        labels=labels,
        test_frames=test_frames,
        test_labels=test_labels,
        run=run,
        out_model=out_model,
        out_history=out_history,
        out_record=out_record,
        out_predictions=out_predictions,
        weights=weights,
        common=common,
        every=every,
        out_common=out_common,
    )
    if true is not None and out_errors and out_metrics:
        score_poses(
            predicted=test.predicted,
            labels=test.given,
            truth=true,
            train=read_pose_table(labels),
            out_errors=out_errors,
            out_metrics=out_metrics,
            info=wildcards,
            depth=(depth, camera),
        )
    if on_common is not None and out_common_errors:
        score_common_poses(on_common.predicted, on_common.given, out_common_errors)


def read_scorable(labels: Path, truth: Path, depth: Path) -> PoseTable:
    """Read the true poses that scores are made from, and check that the other files belong to them.

    Args:
        labels: Poses of the test frames, as the data set labels them.
        truth: True poses of the test frames.
        depth: Depths of the cells of the test frames.

    Returns:
        The true poses.

    Raises:
        InputError: a file cannot be read, or they are not about the same frames.
    """
    labelled, true = read_pose_table(labels), read_pose_table(truth)
    if not np.array_equal(labelled.frame, true.frame):
        raise InputError(
            f"{truth}: its frames are not those of {labels} ({len(true)} and {len(labelled)}"
            " rows); make both anew"
        )
    read_cell_depth(depth, len(labelled))
    return true
