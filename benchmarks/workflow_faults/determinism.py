"""Which files of the workflow come out the same again, stage by stage."""

from __future__ import annotations

import csv
import fnmatch
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from benchmarks.workflow_faults.kills import UNDISTURBED, undisturbed
from benchmarks.workflow_faults.session import RESULTS, copy_repository, run_until
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
COLUMNS = (
    *("stage", "files", "same_again", "made_on_one_core", "same_on_one_core"),
    *("promised", "differing", "why"),
)
# What is made on one core: labels of every kind and a training, with all that they need.
ONE_CORE = (
    f"{RESULTS}/runs/large_room/6k/synfeal/scratch/posenet/seed0/metrics.json",
    *(
        f"{RESULTS}/labels/large_room/6k/{source}/{split}.csv"
        for source in ("sfm", "rgbd-toro", "rgbd-g2o", "noise-p0.3-r20")
        for split in ("train", "test")
    ),
)


class Others(NamedTuple):
    """Hashes by path of results that are compared with those of an undisturbed run on two cores.

    Attributes:
        again: all files anew.
        one_core: those that were made on one core.
    """

    again: Mapping[str, str]
    one_core: Mapping[str, str]


def write_determinism(work: Path, out: Path) -> None:
    """Compare the undisturbed run, the one that was killed again and again, and a part on one core.

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
    one_core = work / "one-core"
    copy_repository(one_core)
    if run_until(one_core, 1, UNDISTURBED, ONE_CORE).status:
        raise InputError(f"{one_core}.log: the run on one core failed; see its end")
    trees = (hashes.tree(place / RESULTS) for place in (work / "killed", one_core))
    others = Others(*trees)
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
    made = set(names) & others.one_core.keys()
    one_core = {name for name in made if others.one_core[name] == expected[name]}
    differing = sorted((set(names) - again) | (made - one_core))
    kinds = sorted({Path(name).name for name in differing})
    reasons = sorted({reason_to_differ(name) or "NOT EXPECTED" for name in differing})
    promised = sum(not reason_to_differ(name) for name in names)
    shown = " ".join(kinds[:6]) + (" ..." if len(kinds) > 6 else "")
    counts = (len(names), len(again), len(made), len(one_core), promised)
    return (stage, *counts, shown, "; ".join(reasons))
