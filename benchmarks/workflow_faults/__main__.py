"""``python -m benchmarks.workflow_faults kills``: see ``--help``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.workflow_faults.determinism import write_determinism
from benchmarks.workflow_faults.kills import shower, summary
from benchmarks.workflow_faults.stages import STAGES, disturb_stages
from synfeal.errors import exit_status

TABLES = Path("results/benchmarks")


def build_parser() -> argparse.ArgumentParser:
    """Options."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.workflow_faults",
        description="Runs the smoke profile in copies of the repository and disturbs it.",
    )
    parser.add_argument("--work", type=Path, required=True, help="directory for the copies; kept")
    commands = parser.add_subparsers(required=True)
    kills = commands.add_parser("kills", help="SIGKILL for all processes, again and again")
    kills.add_argument("--kills", type=int, default=50)
    kills.add_argument("--cores", type=int, default=2)
    kills.add_argument("--seed", type=int, default=0, help="of the moments")
    kills.add_argument("--out", type=Path, default=TABLES / "workflow_faults.csv")
    kills.set_defaults(run=_kills)
    stages = commands.add_parser("stages", help="full disk, killed job, too little memory; as root")
    stages.add_argument("--stages", nargs="*", default=list(STAGES), choices=list(STAGES))
    stages.add_argument("--out", type=Path, default=TABLES / "workflow_faults_stages.csv")
    stages.set_defaults(run=_stages)
    same = commands.add_parser("determinism", help="the undisturbed run against others")
    same.add_argument("--out", type=Path, default=TABLES / "determinism.csv")
    same.set_defaults(run=lambda options: write_determinism(options.work, options.out))
    return parser


def _kills(options: argparse.Namespace) -> None:
    work = options.work.resolve()
    print(summary(shower(work, options.kills, options.cores, options.seed, options.out)))


def _stages(options: argparse.Namespace) -> None:
    rows = disturb_stages(options.work.resolve(), options.stages, options.out)
    good = sum(row.status != 0 and row.again and not row.differing for row in rows)
    print(f"{len(rows)} faults: {good} told by exit status, without damage, mended by the same run")


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    options = build_parser().parse_args(argv)
    return exit_status(lambda: options.run(options), "the rows so far are kept")


if __name__ == "__main__":
    sys.exit(main())
