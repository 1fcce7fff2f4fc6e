"""A training run of the workflow: train, predict, and score in one process.

A process that scores one run and nothing else spends its time on imports. So scores are written
where predictions are made; those of an archive's predictions are written by
:func:`baselines.training.score.write_scores` alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from baselines.config.learning import ModelName
from baselines.training.run import train_and_predict
from baselines.training.score import write_scores
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import read_pose_table
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
    if out_errors:
        check_scorable(test_labels, truth, depth)
    train_and_predict(
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
    if out_errors and out_common_errors and out_metrics:
        write_scores(
            predictions=out_predictions,
            labels=test_labels,
            truth=truth,
            train_labels=labels,
            depth=depth,
            camera=camera,
            common=out_common,
            common_truth=common,
            wildcards=wildcards,
            out_errors=out_errors,
            out_metrics=out_metrics,
            out_common_errors=out_common_errors,
        )


def check_scorable(labels: Path, truth: Path, depth: Path) -> None:
    """Check that the files which scores are made from can be read and belong together.

    Args:
        labels: Poses of the test frames, as the data set labels them.
        truth: True poses of the test frames.
        depth: Depths of the cells of the test frames.

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
