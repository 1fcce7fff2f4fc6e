"""Every stage meets a full disk, a training a kill and too little memory; then again without."""

from __future__ import annotations

import csv
import os
import re
import resource
import signal
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from benchmarks.workflow_faults.kills import undisturbed
from benchmarks.workflow_faults.overlay import fill, make_room, over, remove
from benchmarks.workflow_faults.session import (
    LOOK_EVERY_S,
    RESULTS,
    command_of,
    copy_repository,
    processes_of,
    workflow,
)
from benchmarks.workflow_faults.trees import Hashes, damaged

SET = "large_room/6k"
RUN = f"runs/{SET}/synfeal/scratch"
# What a job of each rule writes, below the results directory; the first is asked for.
STAGES = {
    "scene": tuple(
        f"scenes/pretext_room/{name}"
        for name in ("properties.json", "mesh.glb", "collision.ply", "collision_curve.csv")
    ),
    "plan": ("plans/large_room/test.csv",),
    "coverage": ("plans/large_room/test.coverage.json",),
    "render": ("datasets/large_room/groundtruth/seq-02",),
    "render_packed, pack": ("frames/large_room/test.npy", "frames/large_room/test.json"),
    "dataset": tuple(
        f"datasets/large_room/groundtruth/{name}"
        for name in ("manifest.json", "TrainSplit.txt", "TestSplit.txt")
    ),
    "render_speed": ("scenes/large_room/render_speed.csv",),
    "true_labels": (f"labels/{SET}/synfeal/test.csv",),
    "erroneous_labels": (f"labels/{SET}/noise-p0.3-r20/test.csv",),
    "sfm": tuple(f"groundtruth/{SET}/sfm/test/batch-000.{kind}" for kind in ("csv", "json")),
    "rgbd": tuple(f"groundtruth/{SET}/rgbd/test/batch-000.{kind}" for kind in ("g2o", "json")),
    "posegraph": tuple(
        f"groundtruth/{SET}/rgbd-toro/test/batch-000.{kind}" for kind in ("csv", "json")
    ),
    "chain": tuple(
        f"labels/{SET}/sfm/{name}"
        for name in (
            *("test.csv", "train.csv", "assistance.json", "estimation.json"),
            *("test-unassisted.csv", "train-unassisted.csv"),
        )
    ),
    "pretrain": ("pretrained/googlenet.pt",),
    "train": tuple(
        f"{RUN}/posenet/seed0/{name}"
        for name in ("model.pt", "history.csv", "training.json", "predictions.csv")
    ),
    "score": tuple(f"{RUN}/posenet/seed0/{name}" for name in ("metrics.json", "errors.csv")),
    "table1_meshes": ("tables/table1_meshes.csv", "tables/table1_meshes.tex"),
    "table": ("tables/table4_size.csv", "tables/table4_size.tex"),
    "assistance": ("tables/assistance.csv", "tables/assistance.tex"),
    "label_error": ("tables/label_error.csv", "tables/label_error.tex"),
    "speed_vs_error": ("tables/speed_vs_error.csv",),
    "hard_cases": ("tables/hard_cases.csv",),
    "document": ("tables/all_tables.tex",),
    "figures": ("figures",),
    "summary": ("summary.md", "summary.txt"),
    "claims": ("claims.csv",),
    "provenance": ("provenance.json", "benchmarks.csv"),
    "report": ("report.html",),
    "report_document": ("report.tex",),
}
TRAININGS = tuple(
    f"{RUN}/{model}/seed0/{name}"
    for model in ("posenet2", "posenet")
    for name in ("model.pt", "history.csv", "training.json", "predictions.csv")
)
BEGUN = re.compile(r"samples, on ")  # what a training logs when it has read its data


@dataclass(frozen=True)
class Fault:
    """What one fault did.

    Attributes:
        fault: which.
        stage: the rule it met.
        status: Snakemake's exit status.
        said: the line that says why, of what Snakemake printed.
        left: outputs of the stage under their final names.
        differing: other files that are no longer what they were.
        again: whether the same command, without the fault, ended well and made the same files.
    """

    fault: str
    stage: str
    status: int
    said: str
    left: int
    differing: int
    again: bool


@dataclass(frozen=True)
class Bench:
    """Undisturbed results, a copy of the repository over them, and the hashes of the former."""

    calm: Path
    place: Path
    expected: dict[str, str]
    hashes: Hashes

    def make(self, *targets: str, disturb: Callable[[int], None] | None = None) -> tuple[int, str]:
        """Exit status of Snakemake and what it printed; ``disturb`` is given its process."""
        log = self.place.with_name(f"{self.place.name}.log")
        begin = log.stat().st_size if log.exists() else 0
        names = [f"{RESULTS}/{target}" for target in targets]
        with workflow(self.place, 1, names) as process:
            if disturb:
                disturb(process.pid)
            status = process.wait()
        return status, log.read_bytes()[begin:].decode(errors="replace")

    def row(self, fault: str, stage: str, outputs: tuple[str, ...], met: tuple[int, str]) -> Fault:
        """What the fault left, then the same command again."""
        root = self.place / RESULTS
        left = [name for name in outputs if (root / name).exists()]
        damage = damaged(self.expected, self.hashes.tree(root))
        status, _ = self.make(*outputs)
        same = not damaged(self.expected, self.hashes.tree(root))
        whole = all((root / name).exists() for name in outputs)
        return Fault(
            *(fault, stage, met[0], why(met[1]), len(left), len(damage)),
            again=status == 0 and same and whole,
        )


def why(printed: str) -> str:
    """The line that says what was wrong, without directories."""
    lines = [line.strip() for line in printed.splitlines()]
    said = [line for line in lines if line.startswith("error: ")]
    said += [line for line in lines if "No space left" in line or "SIGKILL" in line]
    return re.sub(r"\S*/", "", said[0]) if said else ""


def full_disk(bench: Bench, stage: str) -> Fault:
    """A job of a stage with no room for its outputs, its log or anything else."""
    with over(bench.calm, bench.place) as disk:
        remove(bench.place / RESULTS, STAGES[stage])
        (bench.place / RESULTS / ".lock").write_text("copied up while there is room")
        fill(disk)
        met = bench.make(*STAGES[stage])
        make_room(disk)
        return bench.row("full disk", stage, STAGES[stage], met)


def in_training(bench: Bench, fault: str, disturb: Callable[[int], None]) -> Fault:
    """Two trainings, the first of which is disturbed once it has begun; the other goes on."""

    def wait_and_disturb(session: int) -> None:
        logs = bench.place / RESULTS / "logs/train" / RUN.removeprefix("runs/")
        for path in logs.rglob("*.log"):
            path.unlink()
        while not any(BEGUN.search(path.read_text()) for path in logs.rglob("*.log")):
            time.sleep(LOOK_EVERY_S)
        for pid in processes_of(session):
            if b".train.py" in command_of(pid) and b"/.snakemake/scripts/" in command_of(pid):
                disturb(pid)

    with over(bench.calm, bench.place):
        remove(bench.place / RESULTS, TRAININGS)
        met = bench.make(*TRAININGS, disturb=wait_and_disturb)
        return bench.row(fault, "train", TRAININGS, met)


def kill(pid: int) -> None:
    """As the system does when memory runs out."""
    os.kill(pid, signal.SIGKILL)


def limit_memory(pid: int) -> None:
    """Let a process have no more than it has."""
    most = int(Path(f"/proc/{pid}/statm").read_text().split()[0]) * resource.getpagesize()
    resource.prlimit(pid, resource.RLIMIT_AS, (most, most))


def disturb_stages(work: Path, stages: list[str], out: Path) -> list[Fault]:
    """All faults, one after the other; a row of ``out`` for each."""
    calm, place, hashes = undisturbed(work / "calm", 2).resolve(), work / "faulty", Hashes()
    copy_repository(place)
    bench = Bench(calm, place, hashes.tree(calm / RESULTS), hashes)
    faults: list[Callable[[], Fault]] = [
        lambda: in_training(bench, "killed job", kill),
        lambda: in_training(bench, "too little memory", limit_memory),
        *(lambda stage=stage: full_disk(bench, stage) for stage in stages),
    ]
    rows: list[Fault] = []
    for fault in faults:
        rows.append(fault())
        _write(out, rows)
    return rows


def _write(path: Path, rows: list[Fault]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Fault)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(map(asdict, rows))
