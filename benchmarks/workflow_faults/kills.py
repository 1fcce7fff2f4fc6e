"""The smoke profile under a shower of SIGKILLs, and what it leaves behind each time."""

from __future__ import annotations

import csv
import shutil
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from benchmarks.workflow_faults.session import (
    HARD_CASES,
    PACKED,
    RESULTS,
    SPEED,
    Ended,
    copy_repository,
    run_until,
)
from benchmarks.workflow_faults.trees import Hashes, damaged, is_passing, missing
from synfeal.run_lock import unfinished

CPU_S = (5.0, 36.0)  # a run is killed after so many seconds of processor time, uniformly drawn
UNDISTURBED = float("inf")
# A job that takes longer than the time between two kills never ends. So after this many kills long
# ones are left in peace once, and runs that begin anew keep what they made.
LEFT_IN_PEACE = {4: ("scenes", *SPEED, HARD_CASES), 14: PACKED}


@dataclass(frozen=True)
class Kill:
    """One start of the workflow that SIGKILL ended, or that ended by itself.

    Attributes:
        kill: counted through all runs; empty where the workflow ended by itself.
        run: results directories are begun anew after each complete one.
        cpu_s: processor time of the start.
        wall_s: how long it lasted.
        jobs: rules at work when it was killed.
        finished: files under final names, those of earlier starts included.
        differing: of them, files that are promised to be those of an undisturbed run and are not.
        missing: files that the complete tree has and this one does not.
        unfinished: what was left that goes in the end: temporary files and directories, parts of
            packed frames, states of trainings.
        unfinished_mb: their size.
        marked: outputs that Snakemake has noted as incomplete.
        outcome: ``killed``; or, where the same command ended by itself, ``complete``.
    """

    kill: int | None
    run: int
    cpu_s: float
    wall_s: float
    jobs: str
    finished: int
    differing: int
    missing: int
    unfinished: int
    unfinished_mb: float
    marked: int
    outcome: str


def shower(work: Path, kills: int, cores: int, seed: int, out: Path) -> list[Kill]:
    """Kill the workflow ``kills`` times, then let it end; every start becomes a row of ``out``.

    Args:
        work: where the repository is copied to, as ``calm`` for the undisturbed run, kept if it is
            there, and as ``killed``.
        kills: how many.
        cores: jobs at a time.
        seed: of the moments.
        out: CSV, columns of :class:`Kill`.

    Raises:
        RuntimeError: a start failed by itself, or left another tree than the undisturbed run.
    """
    hashes = Hashes()
    expected = hashes.tree(undisturbed(work / "calm", cores) / RESULTS)
    place = work / "killed"
    shutil.rmtree(place, ignore_errors=True)
    copy_repository(place)
    moments = np.random.default_rng(seed)
    rows: list[Kill] = []
    n_kills, run, complete = 0, 1, False
    while n_kills < kills or not complete:
        if complete:
            begin_anew(place)
        if n_kills in LEFT_IN_PEACE:
            run_until(place, cores, UNDISTURBED, LEFT_IN_PEACE[n_kills])
        cpu_s = float(moments.uniform(*CPU_S)) if n_kills < kills else UNDISTURBED
        ended = run_until(place, cores, cpu_s)
        n_kills += ended.status is None
        complete = ended.status is not None
        rows.append(seen(ended, place, expected, hashes, n_kills, run))
        write_rows(out, rows)
        check(rows[-1], ended, place)
        run += complete
    return rows


def undisturbed(place: Path, cores: int) -> Path:
    """A copy of the repository with the results of a run that nothing disturbed."""
    if not (place / RESULTS / "report.html").is_file():
        copy_repository(place)
        ended = run_until(place, cores, UNDISTURBED)
        if ended.status != 0:
            raise RuntimeError(f"the undisturbed run failed: see {place}.log")
    return place


def begin_anew(place: Path) -> None:
    """Remove the results of a copy but for what long jobs made."""
    kept = (place / RESULTS / "scenes", place / RESULTS / "frames", place / HARD_CASES)
    for path in sorted((place / RESULTS).rglob("*"), reverse=True):
        if any(keep == path or keep in path.parents for keep in kept):
            continue
        if path.is_file():
            path.unlink()
        elif not any(path.iterdir()):
            path.rmdir()


def seen(
    ended: Ended, place: Path, expected: dict[str, str], hashes: Hashes, n_kills: int, run: int
) -> Kill:
    """What one start left."""
    root = place / RESULTS
    found = hashes.tree(root)
    passing = (p for p in root.rglob("*") if p.is_file() and is_passing(p.relative_to(root)))
    left = [*unfinished(root), *passing]
    incomplete = place / ".snakemake" / "incomplete"
    return Kill(
        kill=n_kills if ended.status is None else None,
        run=run,
        cpu_s=round(ended.cpu_s, 1),
        wall_s=round(ended.wall_s, 1),
        jobs=" ".join(ended.jobs),
        finished=len(found),
        differing=len(damaged(expected, found)),
        missing=len(missing(expected, found)),
        unfinished=len(left),
        unfinished_mb=round(sum(map(_bytes, left)) / 1e6, 1),
        marked=sum(path.is_file() for path in incomplete.rglob("*")),
        outcome="killed" if ended.status is None else "complete" if not ended.status else "failed",
    )


def check(row: Kill, ended: Ended, place: Path) -> None:
    """Stop where something is not as it should be.

    Raises:
        RuntimeError: saying what.
    """
    log = place.with_name(f"{place.name}.log")
    if ended.status:
        raise RuntimeError(f"the workflow failed by itself after a kill: see {log}")
    if row.differing or (row.outcome == "complete" and row.missing + row.unfinished):
        raise RuntimeError(f"what was left is not what an undisturbed run makes: {row}")


def write_rows(path: Path, rows: list[Kill]) -> None:
    """Write the rows as CSV."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Kill)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(map(asdict, rows))


def summary(rows: list[Kill]) -> str:
    """One line about all of them."""
    killed = [row for row in rows if row.outcome == "killed"]
    rules = sorted({job for row in killed for job in row.jobs.split()})
    return (
        f"{len(killed)} kills in {rows[-1].run} runs of the smoke profile, at work: "
        f"{', '.join(rules)}; most files left unfinished {max(row.unfinished for row in killed)}"
        f" ({max(row.unfinished_mb for row in killed):.1f} MB), files that differ from the"
        f" undisturbed run {sum(row.differing for row in rows)}; resumed with the same command"
    )


def _bytes(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else (path,)
    return sum(file.stat().st_size for file in files if file.is_file())
