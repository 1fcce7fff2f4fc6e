"""The workflow at work here and through SLURM, and the crash of its node."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from synfeal.errors import InputError

ROOT = Path(__file__).parents[2]
CLUSTER = ROOT / "setup/slurm_cluster.sh"
LOCAL = ("--cores", "2")
WHAT = ("--configfile", "config/smoke.yaml")
# The profile as it is, but: there is no accounting to ask, a small cluster answers at once, and
# jobs of seconds go so many to a group that there are two groups, one for each core.
SLURM = (
    *("--profile", "workflow/profiles/slurm", "--slurm-status-command", "squeue"),
    *("--slurm-init-seconds-before-status-checks", "5", "--latency-wait", "5"),
    *("--group-components", "fits=20", "plans=3", "chains=2", "shards=5", "batches=5"),
)
LOOK_EVERY_S = 2.0
NODE_GONE_S = 300.0


@dataclass(frozen=True)
class Crash:
    """When the node was killed, found missing and back, in seconds since the run began.

    Attributes:
        trained: models that lay there when it was killed.
        running: jobs that were lost with it.
        killed_s: SIGKILL for its daemon and all its processes.
        noticed_s: the controller called it down.
        back_s: the daemon was there again.
    """

    trained: int
    running: tuple[str, ...]
    killed_s: float
    noticed_s: float
    back_s: float


def snakemake(work: Path, name: str, arguments: Sequence[str]) -> subprocess.Popen[bytes]:
    """The workflow at work, its results below ``<work>/<name>``, what it prints beside them."""
    command = (sys.executable, "-m", "snakemake", *arguments, *WHAT)
    results = ("--config", f"results={work / name}", "--", "all")
    with (work / f"{name}.log").open("ab") as log:
        return subprocess.Popen((*command, *results), cwd=ROOT, stdout=log, stderr=log)


def crash_node(work: Path, begin: float, running: Sequence[str]) -> Crash:
    """Kill the node with what is ``running`` there, wait until it is missed, and start it again."""
    trained = len(_trained(work))
    killed_s = time.monotonic() - begin
    cluster("kill-node", work)
    _wait_for(lambda: any(state.startswith("down") for state in _lines("sinfo", "--format=%T")))
    noticed_s = time.monotonic() - begin
    cluster("start-node", work)
    return Crash(trained, tuple(running), killed_s, noticed_s, time.monotonic() - begin)


def run_local(work: Path) -> float:
    """Seconds of the local run."""
    begin = time.monotonic()
    _ended_well(snakemake(work, "local", LOCAL).wait(), work / "local.log")
    return time.monotonic() - begin


def run_on_cluster(work: Path) -> tuple[float, Crash]:
    """Seconds of the run through SLURM, and the crash in it.

    Raises:
        InputError: the run failed, or no training run was left during which to kill the node.
    """
    begin, crash = time.monotonic(), None
    process = snakemake(work, "slurm", (*SLURM, "--slurm-logdir", str(work / "slurm_logs")))
    try:
        while process.poll() is None:
            time.sleep(LOOK_EVERY_S)
            if crash is None and _trained(work):
                running = _lines("squeue", "--states=RUNNING", "--format=%i %k")
                crash = crash_node(work, begin, running) if running else None
    finally:
        process.kill()
    _ended_well(process.wait(), work / "slurm.log")
    if crash is None:
        raise InputError(f"{work / 'slurm'}: all was trained before; remove it and start again")
    return time.monotonic() - begin, crash


def cluster(action: str, work: Path) -> None:
    """Start the cluster, stop it, kill its node or bring that back.

    Raises:
        InputError: that failed; what to do about it is on standard error.
    """
    if subprocess.run((CLUSTER, action, work / "cluster"), check=False).returncode:
        raise InputError(f"{CLUSTER.name} {action}: did not succeed; see above")


def _trained(work: Path) -> list[Path]:
    return list((work / "slurm").glob("*/runs/**/model.pt"))


def _lines(*command: str) -> list[str]:
    """What a command of SLURM's lists; nothing when the controller is too busy to answer."""
    listing = subprocess.run((*command, "--noheader"), stdout=subprocess.PIPE, text=True)
    return listing.stdout.splitlines()


def _wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + NODE_GONE_S
    while not condition():
        if time.monotonic() > end:
            raise InputError(f"the controller did not miss the node within {NODE_GONE_S:.0f} s")
        time.sleep(LOOK_EVERY_S)


def _ended_well(status: int, log: Path) -> None:
    if status:
        raise InputError(f"{log}: the run failed; see its end, then start the same command again")
