"""A training run of the workflow: train, predict, and score in one process.

A process that scores one run and nothing else spends its time on imports. So scores are written
where predictions are made, of the poses in memory; those of an archive's predictions are written by
:func:`baselines.training.score.write_scores` alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from baselines.config.learning import ModelName
from baselines.training.run import CommonTest, RunFiles, SplitFiles, train_and_predict
from baselines.training.score import score_common_poses, score_poses
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.evaluation.reprojection import read_cell_depth


class Scoring(NamedTuple):
    """Files that predictions are scored against, and those with their scores.

    Attributes:
        truth: True poses of the test frames.
        depth: Depth that the test frames show, for the reprojection error.
        camera: Camera of the frames, for the reprojection error.
        wildcards: Names of the run, which are copied into its metrics.
        out_errors: Errors of the test frames to write.
        out_common_errors: Errors on the common test set to write.
        out_metrics: Scores to write.
    """

    truth: Path
    depth: Path
    camera: CameraConfig
    wildcards: dict[str, str]
    out_errors: Path
    out_common_errors: Path
    out_metrics: Path


def train_and_score(
    model: ModelName,
    train: SplitFiles,
    test: SplitFiles,
    common: CommonTest,
    run: dict[str, Any],
    out: RunFiles,
    scoring: Scoring | None = None,
    weights: Path | None = None,
) -> None:
    """Train a localizer, predict its test frames, and score the predictions.

    Everything that scoring will read is checked before training: no run is lost to a file that
    could have been found missing or damaged at once.

    Args:
        model: Name of the localizer.
        train: Frames to learn from, and their labels.
        test: Frames to predict, and their labels.
        common: The common test set, to predict as well.
        run: Settings of the run, as :func:`baselines.training.run.train_and_predict` takes them.
        out: Files of the run to write.
        scoring: What predictions are scored by; None scores nothing.
        weights: State dict that the backbone starts from; None trains from scratch.

    Raises:
        InputError: a file cannot be used.
    """
    true = read_scorable(test.labels, scoring.truth, scoring.depth) if scoring else None
    own, on_common = train_and_predict(
        model=model, train=train, test=test, run=run, out=out, weights=weights, common=common
    )
    if scoring is None or true is None:
        return
    score_poses(
        predicted=own.predicted,
        labels=own.given,
        truth=true,
        train=read_pose_table(train.labels),
        out_errors=scoring.out_errors,
        out_metrics=scoring.out_metrics,
        info=scoring.wildcards,
        depth=(scoring.depth, scoring.camera),
    )
    if on_common is not None:
        score_common_poses(on_common.predicted, on_common.given, scoring.out_common_errors)


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
            truth,
            f"its frames are not those of {labels} ({len(true)} and {len(labelled)} rows)",
            "make both anew",
        )
    read_cell_depth(depth, len(labelled))
    return true
