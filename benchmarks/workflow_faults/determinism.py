"""Which files of the workflow come out the same again, stage by stage."""

from __future__ import annotations

import csv
import fnmatch
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from benchmarks.workflow_faults.kills import undisturbed
from benchmarks.workflow_faults.session import RESULTS
from benchmarks.workflow_faults.trees import Hashes, reason_to_differ
from synfeal.errors import InputError

# Paths below a results directory, first match; `*` also matches `/`.
STAGES = {
    "meshes": "scenes/*/mesh.glb",
    "collision meshes": "scenes/*/collision.ply",
    "facts of scenes": "scenes/*",
    "plans": "plans/*",
    "packed frames": "frames/*",
    "data sets": "datasets/*",
    "true labels": "labels/*/synfeal/*",
    "noisy labels": "labels/*/noise-*",
    "chained labels": "labels/*",
    "SfM trajectories": "groundtruth/*/sfm/*.csv",
    "RGB-D pose graphs": "groundtruth/*/rgbd/*.g2o",
    "solved pose graphs": "groundtruth/*.csv",
    "facts of batches": "groundtruth/*.json",
    "pretrained weights": "pretrained/*",
    "trained weights": "runs/*/model.pt",
    "training histories": "runs/*/history.csv",
    "predictions": "runs/*/predictions.csv",
    "scores": "runs/*",
    "tables": "tables/*",
    "figures": "figures/*",
    "claims": "claims.csv",
    "summary": "summary.*",
    "report": "report.*",
    "what jobs took": "*",
}
COLUMNS = ("stage", "files", "same_again", "same_on_one_core", "promised", "differing", "why")


class Others(NamedTuple):
    """Hashes by path of results that are compared with those of an undisturbed run on two cores."""

    again: Mapping[str, str]
    one_core: Mapping[str, str]


def write_determinism(work: Path, out: Path) -> None:
    """Compare the undisturbed run, the one that was killed again and again, and one on one core.

    Args:
        work: with ``calm`` and ``killed`` of the kills; ``one-core`` is made if it is not there.
        out: CSV, a row per stage; columns ``COLUMNS``.

    Raises:
        InputError: the kills have not been done.
    """
    work, hashes = work.resolve(), Hashes()
    if not (work / "killed" / RESULTS / "report.html").is_file():
        raise InputError(f"{work}/killed: holds no complete results; run 'kills' there first")
    expected = hashes.tree(undisturbed(work / "calm", 2) / RESULTS)
    one_core = hashes.tree(undisturbed(work / "one-core", 1) / RESULTS)
    others = Others(hashes.tree(work / "killed" / RESULTS), one_core)
    rows = [row_of(stage, expected, others) for stage in STAGES]
    with out.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(row for row in rows if row[1])


def stage_of(name: str) -> str:
    """The stage that writes a file, by its path below the results directory."""
    return next(stage for stage, pattern in STAGES.items() if fnmatch.fnmatch(name, pattern))


def row_of(stage: str, expected: Mapping[str, str], others: Others) -> tuple[object, ...]:
    """How many files of a stage are the same, how many are promised to be, and which are not."""
    names = [name for name in expected if stage_of(name) == stage]
    again = {name for name in names if others.again.get(name) == expected[name]}
    one_core = {name for name in names if others.one_core.get(name) == expected[name]}
    differing = sorted(set(names) - (again & one_core))
    kinds = sorted({Path(name).name for name in differing})
    reasons = sorted({reason_to_differ(name) or "NOT EXPECTED" for name in differing})
    promised = sum(not reason_to_differ(name) for name in names)
    shown = " ".join(kinds[:6]) + (" ..." if len(kinds) > 6 else "")
    return (stage, len(names), len(again), len(one_core), promised, shown, "; ".join(reasons))
