"""Answers of reference methods, scored like the localizers' predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.costs import Facts, timed
from baselines.references.evidence import Evidence
from baselines.references.registry import REFERENCES, Group, in_group
from baselines.training.score import score_run
from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.files import write_json
from synfeal.geometry.poses import quat_wxyz_of


def answer_group(
    group: Group,
    files: Mapping[str, Path],
    camera: CameraConfig,
    seed: int,
    wildcards: Mapping[str, str],
    out_references: Sequence[Path],
    samples_seen: int = 0,
) -> None:
    """Answer by all methods of a group; see :class:`Evidence` and :func:`answer_and_score`."""
    evidence = Evidence(files, camera, seed, samples_seen)
    answer_and_score(evidence, in_group(group), out_references[0].parents[1], wildcards)


def answer_and_score(
    evidence: Evidence, names: Sequence[str], out_dir: Path, info: Mapping[str, Any]
) -> None:
    """Answer for a data set by some methods, and score them.

    Args:
        evidence: the data set.
        names: keys of ``REFERENCES``.
        out_dir: directory with one folder per method.
        info: further keys of the metrics.

    Raises:
        InputError: something the methods need cannot be read.
    """
    for name in names:
        facts: Facts = {}
        with timed(facts, "answer_s"):
            answer = resolve_name(REFERENCES[name].answer)
            poses = pose_table(evidence.test_frames, answer(evidence))
        known = {**info, "reference": name}
        score_answers(poses, evidence.files, out_dir / name, known, facts)


def score_answers(
    answers: PoseTable,
    files: Mapping[str, Path],
    folder: Path,
    info: Mapping[str, Any],
    facts: Facts,
) -> None:
    """Write ``predictions.csv``, ``errors.csv``, ``metrics.json`` and ``facts.json`` of a method.

    Args:
        answers: poses of the test frames; NaN where there is none.
        files: labels and true poses, as in :class:`Evidence`.
        folder: where to write.
        info: further keys of the metrics.
        facts: what the answers took.
    """
    write_pose_table(folder / "predictions.csv", answers)
    score_run(
        *(folder / "predictions.csv", files["test"], files["test_truth"], files["train"]),
        *(folder / "errors.csv", folder / "metrics.json", info),
    )
    write_json(folder / "facts.json", facts | {"frames": len(answers)})


def pose_table(frames: PoseTable, world_from_cam: NDArray[np.float64]) -> PoseTable:
    """A table of poses (N, 4, 4) of which some may be NaN."""
    good = np.asarray(np.isfinite(world_from_cam).all(axis=(1, 2)))
    position_m, quat_wxyz = np.full((len(good), 3), np.nan), np.full((len(good), 4), np.nan)
    position_m[good] = world_from_cam[good, :3, 3]
    if good.any():
        quat_wxyz[good] = quat_wxyz_of(world_from_cam[good])
    return PoseTable(frames.frame, frames.path, position_m, quat_wxyz)
