"""Predictions of reference methods and external localizers, scored like any others.

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
from synfeal.records.tables import COUNT, LIMITLESS_MAYBE, read_frame
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
    """Let all methods of a group answer for one data set, and score them.

    Args:
        group: Group of methods that one job answers by; see
            :class:`~baselines.registry.kinds.ReferenceMethod`.
        files: Files of the data set by name; see :class:`Evidence`.
        camera: Camera of the frames that features were found in.
        seed: Seed of whatever is random.
        wildcards: Further keys of the metrics: scene, size and labels.
        out_references: Files to write, each method's in a folder of its own beside the others'.
        samples_seen: Images that a method that learns is shown.

    Raises:
        InputError: something the methods need cannot be read.
    """
    evidence = Evidence(files, camera, seed, samples_seen)
    answer_and_score(evidence, in_group(group), out_references[0].parents[1], wildcards)


def answer_and_score(
    evidence: Evidence, names: Sequence[str], out_dir: Path, info: Mapping[str, Any]
) -> None:
    """Let some methods answer for one data set, and score each in a folder of its own.

    Args:
        evidence: The data set.
        names: Keys of ``REFERENCES``.
        out_dir: Folder in which each method gets one of its name; see :func:`score_answers`.
        info: Further keys of the metrics.

    Raises:
        InputError: something the methods need cannot be read.
    """
    for name in names:
        facts: Facts = {}
        answer = resolve_name(REFERENCES[name].place)
        evidence.spent.clear()
        with timed(facts, "answer_s"):
            poses = pose_table(evidence.test_frames, answer(evidence))
        facts["prepare_s"] = evidence.spent.get("prepare_s", 0.0)
        facts["answer_s"] -= facts["prepare_s"]
        facts["query_s"] = sum(evidence.query_costs[cost] for cost in REFERENCES[name].query)
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
        answers: Poses of the test frames, NaN where there is none.
        files: Labels and true poses by name: ``train``, ``test``, ``test_truth``.
        folder: Folder of the files.
        info: Further keys of the metrics.
        facts: Processor seconds and memory: ``answer_s`` for all answers, ``prepare_s`` for
            learning or building a map from the labels before, ``query_s`` for what each test frame
            took before that, once for all label sets.
    """
    predictions = folder / "predictions.csv"
    write_pose_table(predictions, answers)
    score_run(
        predictions=predictions,
        labels=files["test"],
        truth=files["test_truth"],
        train_labels=files["train"],
        out_errors=folder / "errors.csv",
        out_metrics=folder / "metrics.json",
        info=info,
    )
    write_json(folder / "facts.json", facts | {"frames": len(answers)})


def pose_table(frames: PoseTable, world_from_cam: NDArray[np.float64]) -> PoseTable:
    """Make a pose table of which some poses may be NaN.

    Args:
        frames: Frames and paths of the table; its poses are not used.
        world_from_cam: Poses (N, 4, 4).
    """
    good = np.asarray(np.isfinite(world_from_cam).all(axis=(1, 2)))
    position_m, quat_wxyz = np.full((len(good), 3), np.nan), np.full((len(good), 4), np.nan)
    position_m[good] = world_from_cam[good, :3, 3]
    if good.any():
        quat_wxyz[good] = quat_wxyz_of(world_from_cam[good])
    return PoseTable(frames.frame, frames.path, position_m, quat_wxyz)


# A frame without an answer may be left out, or have empty cells.
ANSWERS = {"frame": COUNT, **dict.fromkeys(COLUMNS[2:], LIMITLESS_MAYBE)}


def answer_externally(
    files: Mapping[str, Path],
    method: Mapping[str, Any],
    named: Mapping[str, str],
    wildcards: Mapping[str, str],
    out_references: Sequence[Path],
) -> None:
    """Run the command of a method, or take its file ``poses``, and score the answers.

    Args:
        files: Labels, true poses and packed frames by name, and ``poses``.
        method: Settings: ``command`` or ``poses``.
        named: Data set, for the placeholders of the command; see :func:`run_external`.
        wildcards: Further keys of the metrics.
        out_references: Files to write, all in one folder.

    Raises:
        InputError: The command fails, or the answers cannot be read.
    """
    folder, facts = out_references[0].parent, Facts()
    with timed(facts, "answer_s"):
        begin = time.perf_counter()
        found = files["poses"] if method["poses"] else None
        path = found or run_external(method["command"], files, named, folder)
    facts["answer_s"] = 0.0 if found else time.perf_counter() - begin  # another process worked
    facts |= {"prepare_s": 0.0, "query_s": 0.0}  # a command does both in the above
    poses = read_answers(path, read_pose_table(files["test"]))
    score_answers(poses, files, folder, wildcards, facts)


def run_external(
    command: str, files: Mapping[str, Path], named: Mapping[str, str], folder: Path
) -> Path:
    """Run a command that writes ``answers.csv`` to a folder.

    Args:
        command: Command line; its placeholders are the keys of ``named``, training frames and
            labels, test frames and their number, and ``out``.
        files: Packed frames and labels by name: ``train_frames``, ``train``, ``test_frames``,
            ``test``.
        named: Values of further placeholders.
        folder: Folder of the answers.

    Returns:
        Path of the answers.

    Raises:
        InputError: The command has an unknown placeholder, fails, or writes nothing.
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
            "references.external",
            f"command '{command}' cannot be filled ({why(error)}); placeholders are"
            f" {', '.join(values)}",
        ) from error
    except (OSError, subprocess.CalledProcessError) as error:
        raise InputError(
            "references.external",
            f"command '{command}' failed ({why(error)}); the job's log has the rest",
        ) from error
    if not out.is_file():
        raise InputError("references.external", f"command '{command}' wrote no {out}")
    return out


def read_answers(path: Path, frames: PoseTable) -> PoseTable:
    """Read answers for some test frames, in any order.

    Args:
        path: CSV with at least the columns ``frame,tx,ty,tz,qw,qx,qy,qz``: ``world_from_cam``.
        frames: The test frames.

    Returns:
        Poses of all test frames, NaN for those that are not in the file.

    Raises:
        InputError: The file cannot be read, lacks a column, holds anything but numbers, or names a
            frame twice or one that is not in the test set.
    """
    found = read_frame(path, ANSWERS, f"write the columns {','.join(ANSWERS)}")
    twice = found.frame[found.frame.duplicated()]
    if len(twice):
        raise InputError(path, f"frame {twice.iloc[0]} appears twice", "keep one answer")
    unknown = found.frame[~found.frame.isin(frames.frame)]
    if len(unknown):
        raise InputError(
            path,
            f"frame {unknown.iloc[0]} is not in the test set of {len(frames)} frames, which are"
            " counted from 0",
        )
    values = found.set_index("frame").reindex(frames.frame).to_numpy()
    return PoseTable(frames.frame, frames.path, values[:, :3], values[:, 3:])
