"""Archive a finished replication, or pool those that are archived.

    python -m reproduction.replications archive results/replication_101 --seed 101
    python -m reproduction.replications pool

Archives lie in ``results/published/replications/<seed>``, the pooled tables beside them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from reproduction.config.load import parse_config
from reproduction.replications.archive import ERRORS, write_archive
from reproduction.replications.pooling import write_pooled
from synfeal.config.load import merge, read_yaml
from synfeal.errors import exit_status

PROFILE = (Path("config/config.yaml"), Path("config/replication.yaml"))
ARCHIVES = Path("results/published/replications")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the two commands."""
    parser = argparse.ArgumentParser(
        prog="reproduction.replications",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    archive = commands.add_parser("archive", help="archive a finished run")
    archive.add_argument("root", type=Path, help="its results")
    archive.add_argument("--seed", type=int, required=True, help="its seed")
    pool = commands.add_parser("pool", help="pool all archives")
    for command in (archive, pool):
        command.add_argument("--archives", type=Path, default=ARCHIVES, help="where they lie")
    arguments = parser.parse_args(argv)
    return exit_status(lambda: _run(arguments), "do that again")


def _run(arguments: argparse.Namespace) -> None:
    if arguments.command == "pool":
        folders = sorted(path.parent for path in arguments.archives.glob(f"*/{ERRORS}"))
        write_pooled(folders, arguments.archives)
        return
    values = merge(*map(read_yaml, PROFILE))
    named = {"seed": arguments.seed, "profile": arguments.root.name}
    config = parse_config(merge(values, named), str(PROFILE[-1]))
    write_archive(arguments.root, config, arguments.archives / str(arguments.seed))


if __name__ == "__main__":
    sys.exit(main())
