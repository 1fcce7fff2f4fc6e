"""The smoke profile on a SLURM cluster whose node crashes in the middle, against a local run.

``python -m tests.slurm_run --work DIR`` starts a cluster of one node on this machine
(``setup/slurm_cluster.sh``), runs the workflow with ``workflow/profiles/slurm`` through it, kills
the node once training runs are under way, lets it come back, and sets the files beside those of
``snakemake --cores 2``; it ends with exit status 1 where they differ. What either run has made is
kept: the same command goes on there.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from synfeal.errors import InputError, exit_status
from synfeal.files import atomic_path
from tests.slurm_run.page import compare, page
from tests.slurm_run.run import cluster, run_local, run_on_cluster

OUT = Path("results/benchmarks/slurm.md")


def main(arguments: Sequence[str] | None = None) -> int:
    """Both runs, the comparison, and the page."""
    name = "python -m tests.slurm_run"
    parser = argparse.ArgumentParser(prog=name, description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="directory for both runs; kept")
    parser.add_argument("--local", type=Path, help="results of a local run that has been made")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    left = f"what was made lies in {options.work}; the same command goes on there"
    return exit_status(lambda: _compare(options.work.resolve(), options.local, options.out), left)


def _compare(work: Path, local: Path | None, out: Path) -> None:
    work.mkdir(parents=True, exist_ok=True)
    local_s = None if local else run_local(work)
    try:
        cluster("start", work)
        slurm_s, crash = run_on_cluster(work)
    finally:
        cluster("stop", work)
    files = compare(local or work / "local/smoke", work / "slurm/smoke")
    text = page((local_s, slurm_s), crash, work / "cluster", files)
    with atomic_path(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(text)
    if files.differing:
        raise InputError(f"{out}: {len(files.differing)} files differ or lack; both are in {work}")


if __name__ == "__main__":
    sys.exit(main())
