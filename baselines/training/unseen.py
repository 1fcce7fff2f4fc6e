"""Errors of a trained localizer where it has not been.

Held-out parts of the frames it learned from say less of that than a test split, whose frames were
taken on their own: so these are answered as ``synfeal localize`` answers, and their errors are what
its user gets.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from baselines.localizers.memory import memory_errors
from baselines.training.checkpoint import TrainedLocalizer, UnseenScore
from baselines.training.data import CHUNK, held_out_stretch, read_images
from baselines.training.own_frames import PackedFrames
from baselines.training.selection import HeldOutErrors
from baselines.training.virtual_views import VirtualViews
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.evaluation.metrics import ORIENTATION, POSITION, pose_errors
from synfeal.records.progress import Progress

MOST_TEST_FRAMES = 1000  # more, evenly thinned to so many, do not make a median more exact


@memory_errors()
def score_test_split(
    trained: TrainedLocalizer, learned: PackedFrames, test: PackedFrames, turns: int
) -> UnseenScore:
    """Score a localizer on the test frames of its data sets.

    Args:
        trained: The localizer.
        learned: Frames that it learned from.
        test: Test frames, in the same world.
        turns: Pairs of virtual rotations that each pose is averaged over.

    Raises:
        MemoryError: There is too little memory.
    """
    given = read_pose_table(test.labels)
    input_px = trained.description.network.input_px
    images = read_images(test.frames, len(given), input_px, trained.device)
    views = VirtualViews(trained, turns)
    answers = []
    with Progress(len(given), "test") as progress:
        for start in range(0, len(given), CHUNK):
            some = images[start : start + CHUNK]
            answers.append(views.predict(some))
            progress.update(len(some))
    position_m, quat_wxyz = (np.concatenate(part) for part in zip(*answers, strict=True))
    errors = pose_errors(PoseTable(given.frame, given.path, position_m, quat_wxyz), given)
    middle_m = read_pose_table(learned.labels).position_m.mean(axis=0)
    return UnseenScore(
        frames="test split",
        n_frames=len(given),
        position_m=_finite(np.median(errors[POSITION])),
        orientation_deg=_finite(np.median(errors[ORIENTATION])),
        constant_m=_constant_m(given.position_m, middle_m),
    )


def score_held_out(
    errors: HeldOutErrors, learned: PackedFrames, share: float, seed: int
) -> UnseenScore:
    """Put errors on held-out frames into the form of those on a test split.

    Args:
        errors: Errors at the end of the run.
        learned: All frames of the run.
        share: Share of the paths that were held out.
        seed: Seed of the draw.
    """
    table = read_pose_table(learned.labels)
    mask = held_out_stretch(table.path, share, seed)
    middle_m = table.position_m[~mask].mean(axis=0)
    return UnseenScore(
        frames="held out",
        n_frames=int(mask.sum()),
        position_m=_finite(errors.position_m),
        orientation_deg=_finite(errors.orientation_deg),
        constant_m=_constant_m(table.position_m[mask], middle_m),
    )


def _constant_m(position_m: NDArray[np.float64], middle_m: NDArray[np.float64]) -> float:
    """Compute the median error of answering the same position (3,) to all frames."""
    return float(np.median(np.linalg.norm(position_m - middle_m, axis=1)))


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
