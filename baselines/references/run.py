"""Answers of reference methods, and of somebody else's localizer, scored like predictions.

A localizer of somebody else's is a command to run or a file to read. It is given what the
localizers of the paper are given: the training frames, their labels, and the test frames. No label
of a test frame is passed to it.
"""

from __future__ import annotations

import shlex
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from baselines.references.evidence import Evidence
from baselines.references.registry import REFERENCES, in_group
from baselines.registry.kinds import Group
from baselines.training.score import score_run
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import COLUMNS, PoseTable, read_pose_table, write_pose_table
from synfeal.errors import InputError, why
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.records.files import write_json
from synfeal.records.timing import Facts, timed


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
    """Answer by some of ``REFERENCES``, each in a folder of ``out_dir``, and score them.

    Raises:
        InputError: something the methods need cannot be read.
    """
    for name in names:
        facts: Facts = {}
        with timed(facts, "answer_s"):
            answer = resolve_name(REFERENCES[name].place)
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

    Answers are poses of the test frames, NaN where there is none; ``info`` are further keys of the
    metrics, and ``facts`` what the answers took.
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


NEEDED = ("frame", *COLUMNS[2:])


def answer_externally(
    files: Mapping[str, Path],  # labels, true poses and packed frames by name, and ``poses``
    method: Mapping[str, Any],  # settings: ``command`` or ``poses``
    named: Mapping[str, str],  # see :func:`run_external`
    wildcards: Mapping[str, str],  # further keys of the metrics
    out_references: Sequence[Path],  # files to write, all in one folder
) -> None:
    """Run the command of a method, or take its file ``poses``, and score the answers.

    Raises:
        InputError: the command fails, or the answers cannot be read.
    """
    folder, facts = out_references[0].parent, Facts()
    with timed(facts, "answer_s"):
        begin = time.perf_counter()
        found = files["poses"] if method["poses"] else None
        path = found or run_external(method["command"], files, named, folder)
    facts["answer_s"] = 0.0 if found else time.perf_counter() - begin  # another process worked
    poses = read_answers(path, read_pose_table(files["test"]))
    score_answers(poses, files, folder, wildcards, facts)


def run_external(
    command: str, files: Mapping[str, Path], named: Mapping[str, str], folder: Path
) -> Path:
    """Run a command that writes ``answers.csv`` to a folder; where that lies.

    Its placeholders are ``named``, training frames and labels, test frames and their number, and
    ``out``.

    Raises:
        InputError: the command has an unknown placeholder, fails, or writes nothing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    out = folder / "answers.csv"
    values = {
        **named,
        "train_frames": files["train_frames"],
        "train_labels": files["train"],
        "test_frames": files["test_frames"],
        "n_test": len(read_pose_table(files["test"])),
        "out": out,
    }
    try:
        words = [word.format(**values) for word in shlex.split(command)]
        subprocess.run(words, check=True)
    except (KeyError, ValueError, IndexError) as error:
        raise InputError(
            f"references.external: command '{command}' cannot be filled ({why(error)});"
            f" placeholders are {', '.join(values)}"
        ) from error
    except (OSError, subprocess.CalledProcessError) as error:
        raise InputError(
            f"references.external: command '{command}' failed ({why(error)});"
            " the job's log has the rest"
        ) from error
    if not out.is_file():
        raise InputError(f"references.external: command '{command}' wrote no {out}")
    return out


def read_answers(path: Path, frames: PoseTable) -> PoseTable:
    """Answers for some test frames, in any order; NaN for frames that are not in the file.

    It is CSV with at least the columns ``frame,tx,ty,tz,qw,qx,qy,qz``: ``world_from_cam``.

    Raises:
        InputError: the file cannot be read, lacks a column, holds anything but numbers, or names a
            frame twice or one that is not in the test set.
    """
    try:
        found = pd.read_csv(path, usecols=list(NEEDED)).astype(np.float64)
    except (OSError, ValueError) as error:
        message = (
            f"{path}: cannot be read as answers with columns {','.join(NEEDED)} ({why(error)})"
        )
        raise InputError(message) from error
    twice = found.frame[found.frame.duplicated()]
    if len(twice):
        raise InputError(f"{path}: frame {twice.iloc[0]:g} appears twice; keep one answer")
    unknown = found.frame[~found.frame.isin(frames.frame)]
    if len(unknown):
        raise InputError(
            f"{path}: frame {unknown.iloc[0]:g} is not in the test set of {len(frames)} frames,"
            " which are counted from 0"
        )
    values = found.set_index("frame").reindex(frames.frame).to_numpy()
    return PoseTable(frames.frame, frames.path, values[:, :3], values[:, 3:])
