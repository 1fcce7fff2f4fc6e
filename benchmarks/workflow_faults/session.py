"""A run of the workflow in a copy of the repository, with all the processes that belong to it."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
RESULTS = Path("results", "smoke")
HARD_CASES = f"{RESULTS}/tables/hard_cases.csv"
ALL = ("all",)
SCENES = ("large_room", "sanctuary")
SPEED = tuple(f"{RESULTS}/scenes/{name}/render_speed.csv" for name in SCENES)
PACKED = tuple(f"{RESULTS}/frames/{name}/train.npy" for name in (*SCENES, "pretext_room"))
LOOK_EVERY_S = 0.25
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
SCRIPT = re.compile(rb"/\.snakemake/scripts/tmp\w+\.(\w+)\.py")


class Ended(NamedTuple):
    """How a run of the workflow came to its end.

    Attributes:
        status: exit status; None if it was killed.
        cpu_s: processor time of all its processes.
        wall_s: from its start to its end.
        jobs: rules whose jobs were at work when it was killed, sorted.
    """

    status: int | None
    cpu_s: float
    wall_s: float
    jobs: tuple[str, ...]


def copy_repository(out: Path) -> None:
    """Every file of the working tree that git tracks or would, results aside."""
    listing = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    found = subprocess.run(listing, cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, found.split("\0")):
        if (ROOT / name).is_file() and not name.startswith("results/"):
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, out / name)


@contextmanager
def workflow(
    place: Path, cores: int, targets: Sequence[str] = ALL, **more: str
) -> Iterator[subprocess.Popen[bytes]]:
    """The workflow at work in a copy of the repository, in a session of its own; then it is over.

    Args:
        place: the copy; what is printed is appended to ``run.log`` beside it.
        cores: jobs at a time.
        targets: what to make.
        more: of the environment.
    """
    options = ("--cores", str(cores), "--configfile", "config/smoke.yaml")
    command = (sys.executable, "-m", "snakemake", *options, "--", *targets)
    fixed = {"PYTHONPATH": str(place), "PYTHONHASHSEED": "0", "OMP_NUM_THREADS": "1"}
    with place.with_name(f"{place.name}.log").open("ab") as log:
        process = subprocess.Popen(
            command,
            cwd=place,
            env={**os.environ, **fixed, **more},
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        try:
            yield process
        finally:
            kill_session(process)


def run_until(place: Path, cores: int, cpu_s: float, targets: Sequence[str] = ALL) -> Ended:
    """Run the smoke profile; kill it and all its jobs once they have used ``cpu_s`` seconds."""
    begin = time.monotonic()
    used_s = 0.0
    with workflow(place, cores, targets) as process:
        while process.poll() is None:
            used_s = max(used_s, sum(cpu_of(pid) for pid in processes_of(process.pid)))
            if used_s >= cpu_s:
                jobs = jobs_of(process.pid)
                kill_session(process)
                return Ended(None, used_s, time.monotonic() - begin, jobs)
            time.sleep(LOOK_EVERY_S)
    return Ended(process.returncode, used_s, time.monotonic() - begin, ())


def kill_session(process: subprocess.Popen[bytes]) -> None:
    """SIGKILL for every process of a session, until there is none."""
    while alive := processes_of(process.pid):
        for pid in alive:
            _kill(pid)
        process.poll()
        time.sleep(0.01)
    process.wait()


def processes_of(session: int) -> list[int]:
    """Identifiers of the processes of a session that have not ended."""
    fields = ((int(name.name), _stat(int(name.name))) for name in Path("/proc").glob("[0-9]*"))
    return [pid for pid, stat in fields if stat and int(stat[3]) == session and stat[0] != "Z"]


def cpu_of(pid: int) -> float:
    """Seconds of processor time of a process and of its children that have ended."""
    stat = _stat(pid)
    return sum(map(int, stat[11:15])) / TICKS_PER_S if stat else 0.0


def jobs_of(session: int) -> tuple[str, ...]:
    """Rules whose scripts are at work in a session, sorted."""
    found = [SCRIPT.search(command_of(pid)) for pid in processes_of(session)]
    rule_of = {match[0]: match[1].decode() for match in found if match}  # a shell names it too
    return tuple(sorted(rule_of.values()))


def command_of(pid: int) -> bytes:
    """What a process was started with; nothing if it has ended."""
    return _read(Path(f"/proc/{pid}/cmdline"))


def _stat(pid: int) -> list[str]:
    """Fields of ``/proc/<pid>/stat`` after the name: state, parent, group, session and so on."""
    return _read(Path(f"/proc/{pid}/stat")).decode(errors="replace").rpartition(")")[2].split()


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:  # it has ended meanwhile
        return b""


def _kill(pid: int) -> None:
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return
