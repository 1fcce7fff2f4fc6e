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

    What scoring reads is looked at before training: no run is lost for what could be known before.

    Args:
        model: the localizer.
        frames: packed frames to learn from.
        labels: their poses.
        test_frames: packed frames of the test set.
        test_labels: their poses, as the data set labels them.
        run: see :func:`reproduction.design.runs.training_parameters`.
        truth: true poses of the test frames.
        depth: what the test frames show, for the reprojection error.
        camera: camera of the frames, for the reprojection error.
        common: true poses of the common test set.
        every: of how many frames of the common test set one is predicted.
        wildcards: what the run is; stands in the metrics, too.
        out_model: checkpoint.
        out_history: losses.
        out_record: what the run was trained from.
        out_predictions: poses of the test frames.
        out_common: poses of the common test set.
        out_errors: errors of the test frames; without it nothing is scored.
        out_common_errors: errors on the common test set.
        out_metrics: what is printed of the errors.
        weights: of the backbone; none: from scratch.

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
    """Read what scores are made from.

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
