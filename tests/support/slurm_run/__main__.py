"""The smoke profile on a SLURM cluster whose node crashes in the middle, against a local run.

``python -m tests.support.slurm_run --work DIR`` starts a cluster of one node on this machine
(``setup/slurm_cluster.sh``), runs the workflow with ``workflow/profiles/slurm`` through it, kills
the node once training runs are under way, lets it come back, and sets the files beside those of
``snakemake --cores 2``; it ends with exit status 1 where they differ. What either run has made is
kept: the same command goes on there.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from synfeal.errors import InputError, exit_status
from synfeal.records.files import atomic_path
from tests.support.slurm_run.trees import differing, hashes_of, reason_to_differ

ROOT = Path(__file__).parents[3]
CLUSTER = ROOT / "setup/slurm_cluster.sh"
OUT = Path("results/benchmarks/slurm.md")
# The profile as it is, but: there is no accounting to ask, a small cluster answers at once, and
# jobs of seconds go so many to a group that there are two groups, one for each core.
SLURM = (
    *("--profile", "workflow/profiles/slurm", "--slurm-status-command", "squeue"),
    *("--slurm-init-seconds-before-status-checks", "5", "--latency-wait", "5"),
    *("--group-components", "fits=20", "plans=3", "chains=2", "shards=5", "batches=5"),
)
LOOK_EVERY_S, NODE_GONE_S = 2.0, 300.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Both runs, the comparison, and the page."""
    name = "python -m tests.support.slurm_run"
    parser = argparse.ArgumentParser(prog=name, description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="directory for both runs; kept")
    parser.add_argument("--local", type=Path, help="results of a local run that has been made")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    left = f"what was made lies in {options.work}; the same command goes on there"
    return exit_status(lambda: _compare(options.work.resolve(), options.local, options.out), left)


def _compare(work: Path, local: Path | None, out: Path) -> None:
    work.mkdir(parents=True, exist_ok=True)
    begin = time.monotonic()
    if local is None:
        _ended_well(_snakemake(work, "local", ("--cores", "2")).wait(), work / "local.log")
    local_s = None if local else time.monotonic() - begin
    try:
        cluster("start", work / "cluster")
        slurm_s, crash = _run_on_cluster(work)
    finally:
        cluster("stop", work / "cluster")
    trees = local or work / "local/smoke", work / "slurm/smoke"
    text, off = page(trees, (local_s, slurm_s), crash, work / "cluster")
    with atomic_path(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(text)
    if off:
        raise InputError(f"{out}: {len(off)} files differ or lack; both are in {work}")


def _snakemake(work: Path, name: str, arguments: Sequence[str]) -> subprocess.Popen[bytes]:
    """The workflow at work, its results below ``<work>/<name>``, what it prints beside them."""
    command = (sys.executable, "-m", "snakemake", *arguments, "--configfile", "config/smoke.yaml")
    results = ("--config", f"results={work / name}", "--", "all")
    with (work / f"{name}.log").open("ab") as log:
        return subprocess.Popen((*command, *results), cwd=ROOT, stdout=log, stderr=log)


def _run_on_cluster(work: Path) -> tuple[float, list[str]]:
    """Seconds of the run through SLURM, and what became of the crash in it.

    Raises:
        InputError: the run failed, or no training run was left during which to kill the node.
    """
    begin, crash = time.monotonic(), []
    process = _snakemake(work, "slurm", (*SLURM, "--slurm-logdir", str(work / "slurm_logs")))
    try:
        while process.poll() is None:
            time.sleep(LOOK_EVERY_S)
            trained = list((work / "slurm").glob("*/runs/**/model.pt"))
            running = _lines("squeue", "--states=RUNNING", "--format=%i %k") if trained else []
            if running and not crash:
                crash = _crash_node(work, begin, len(trained), running)
    finally:
        process.kill()
    _ended_well(process.wait(), work / "slurm.log")
    if not crash:
        raise InputError(f"{work / 'slurm'}: all was trained before; remove it and start again")
    return time.monotonic() - begin, crash


def _crash_node(work: Path, begin: float, trained: int, running: Sequence[str]) -> list[str]:
    """Kill the node with what is ``running`` there, wait until it is missed, start it again.

    Returns:
        What happened in a sentence, then the jobs that were lost.
    """
    at_s = [time.monotonic() - begin]
    cluster("kill-node", work / "cluster")
    _wait_for(lambda: any(state.startswith("down") for state in _lines("sinfo", "--format=%T")))
    at_s.append(time.monotonic() - begin)
    cluster("start-node", work / "cluster")
    at_s.append(time.monotonic() - begin)
    return [
        f"After {at_s[0]:.0f} s, with {trained} models trained, the node was killed; it was missed"
        f" after {at_s[1] - at_s[0]:.0f} s and back {at_s[2] - at_s[1]:.0f} s later.",
        *running,
    ]


def cluster(action: str, folder: Path) -> None:
    """Start the cluster, stop it, kill its node or bring that back.

    Raises:
        InputError: that failed; what to do about it is on standard error.
    """
    if subprocess.run((CLUSTER, action, folder), check=False).returncode:
        raise InputError(f"{CLUSTER.name} {action}: did not succeed; see above")


def _lines(*command: str) -> list[str]:
    """Return what a command of SLURM's lists; nothing when the controller is too busy to answer."""
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


if __name__ == "__main__":
    sys.exit(main())


# What the controller writes about a node that is lost and found.
RECOVERY = re.compile(r"requeu|not responding|now responding|returned to service", re.IGNORECASE)


def differing_files(local: Path, slurm: Path) -> tuple[list[str], list[str]]:
    """Files promised to be the same, apart from times, and those that are not or lack."""
    expected, found = hashes_of(local), hashes_of(slurm)
    return tuple(
        sorted(n for n in names if not reason_to_differ(n))
        for names in (expected, differing(expected, found))
    )


def page(
    trees: tuple[Path, Path],
    seconds: tuple[float | None, float],
    crash: Sequence[str],
    cluster_dir: Path,
) -> tuple[str, list[str]]:
    """The evidence as a page, and the files that differ.

    Args:
        trees: results of the local run and of SLURM's.
        seconds: of either.
        crash: what happened to the node, then the jobs that were lost.
        cluster_dir: with the logs of the controller; of its ``jobcomp/filetxt``, one line of
            ``key=value`` for each end of a job.
    """
    promised, off = differing_files(*trees)
    tables = {name for name in promised if name.startswith("tables/")}
    took = "made before" if seconds[0] is None else f"{seconds[0]:.0f}"
    text = (cluster_dir / "jobs.txt").read_text(encoding="utf-8")
    ends = re.findall(r"^JobId=(\S+) .*JobState=(\S+)", text, re.MULTILINE)
    states = Counter(state for _, state in ends)
    story, *lost = crash
    log = (cluster_dir / "slurmctld.log").read_text(encoding="utf-8").splitlines()
    lines = [
        "# The smoke profile on SLURM",
        "Written by `make test-slurm` ([docs/clusters.md](../../docs/clusters.md)).",
        "| | local, two cores | SLURM, one node |\n|---|---|---|\n"
        f"| seconds | {took} | {seconds[1]:.0f} |\n"
        f"| files that are promised to be the same | {len(promised)} | "
        f"{len({*promised} - {*off})} equal |\n"
        f"| of these, tables | {len(tables)} | {len(tables - {*off})} equal |",
        "Equal is byte by byte, without the columns and rows that say how long something took and"
        " how much memory.",
        f"Files that differ or lack: {', '.join(off) or 'none'}.",
        f"SLURM jobs: {len({job for job, _ in ends})}; ends of jobs: "
        + ", ".join(f"{count} {state}" for state, count in sorted(states.items()))
        + ".",
        f"{story} Lost with it:",
        "\n".join(
            f"- `{job}`: {', then '.join(s for end, s in ends if end == job.split()[0])}"
            for job in lost
        ),
        "What the controller wrote:",
        "\n".join(["```", *filter(RECOVERY.search, log), "```"]),
    ]
    return "\n\n".join(lines) + "\n", off
