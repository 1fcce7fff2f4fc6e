"""Answers of reference methods, scored like the localizers' predictions."""

from __future__ import annotations

import resource
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.references.evidence import Evidence
from baselines.references.registry import REFERENCES
from baselines.training.score import score_run
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.files import write_json
from synfeal.geometry.poses import quat_wxyz_of


def answer_and_score(
    evidence: Evidence, names: Sequence[str], out_dir: Path, info: Mapping[str, Any]
) -> None:
    """Write ``predictions.csv``, ``errors.csv``, ``metrics.json``, ``facts.json`` of some methods.

    Args:
        evidence: the data set.
        names: keys of ``REFERENCES``.
        out_dir: directory with one folder per method.
        info: further keys of the metrics.

    Raises:
        InputError: something the methods need cannot be read.
    """
    for name in names:
        begin = time.process_time()
        poses = pose_table(evidence.test_frames, resolve_name(REFERENCES[name].answer)(evidence))
        seconds = time.process_time() - begin
        known = {**info, "reference": name}
        score_answers(poses, evidence.labels, evidence.truth, out_dir / name, known, seconds)


def score_answers(
    answers: PoseTable,
    labels: Path,
    truth: Path,
    folder: Path,
    info: Mapping[str, Any],
    seconds: float,
) -> None:
    """Write the answers of one method, their errors, their scores, and what they took.

    Args:
        answers: poses of the test frames; NaN where there is none.
        labels: folder of the label set: ``train.csv``, ``test.csv``.
        truth: folder of the true poses, likewise.
        folder: where to write.
        info: further keys of the metrics.
        seconds: spent on the answers.
    """
    write_pose_table(folder / "predictions.csv", answers)
    score_run(
        *(folder / "predictions.csv", labels / "test.csv", truth / "test.csv"),
        *(labels / "train.csv", folder / "errors.csv", folder / "metrics.json"),
        info,
    )
    peak_memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    facts = {"answer_s": seconds, "frames": len(answers), "peak_memory_mb": peak_memory_mb}
    write_json(folder / "facts.json", facts)


def pose_table(frames: PoseTable, world_from_cam: NDArray[np.float64]) -> PoseTable:
    """A table of poses (N, 4, 4) of which some may be NaN."""
    good = np.asarray(np.isfinite(world_from_cam).all(axis=(1, 2)))
    position_m, quat_wxyz = np.full((len(good), 3), np.nan), np.full((len(good), 4), np.nan)
    position_m[good] = world_from_cam[good, :3, 3]
    if good.any():
        quat_wxyz[good] = quat_wxyz_of(world_from_cam[good])
    return PoseTable(frames.frame, frames.path, position_m, quat_wxyz)
