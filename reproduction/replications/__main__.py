"""Archive a replication, list what it still needs, or pool those that are archived.

    python -m reproduction.replications remaining results/replication_101 --seed 101
    python -m reproduction.replications archive results/replication_101 --seed 101
    python -m reproduction.replications pool

Archives lie in ``results/published/replications/<seed>``, the pooled tables beside them. A run that
was interrupted can be archived, too; ``remaining`` then prints the Snakemake targets of the rest,
for a machine that has nothing but the archive.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from reproduction.config.load import parse_config
from reproduction.config.profile import Config
from reproduction.replications.archive import ERRORS, remaining, write_archive
from reproduction.replications.pooling import write_pooled
from reproduction.runs.published import PUBLISHED, REPLICATIONS
from synfeal.config.load import merge, read_yaml
from synfeal.errors import InputError, exit_status

PROFILE = (Path("config/config.yaml"), Path("config/replication.yaml"))
ARCHIVES = PUBLISHED / REPLICATIONS
ANNOUNCED = range(101, 106)  # seeds, docs/rules.md


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the two commands."""
    parser = argparse.ArgumentParser(
        prog="reproduction.replications",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    archive = commands.add_parser("archive", help="archive what a run has made")
    rest = commands.add_parser("remaining", help="list the targets that are not archived")
    for command in (archive, rest):
        command.add_argument("root", type=Path, help="its results")
        command.add_argument("--seed", type=int, required=True, help="its seed")
    pool = commands.add_parser("pool", help="pool all archives")
    rest.add_argument(
        "--labels",
        choices=("exact", "estimated"),
        help="only rows whose labels are exact, noise put in or not, or only the others",
    )
    for command in (archive, rest, pool):
        command.add_argument("--archives", type=Path, default=ARCHIVES, help="where they lie")
    arguments = parser.parse_args(argv)
    return exit_status(lambda: _run(arguments), "do that again")


def _run(arguments: argparse.Namespace) -> None:
    if arguments.command == "pool":
        folders = sorted(path.parent for path in arguments.archives.glob(f"*/{ERRORS}"))
        _check_announced([folder.name for folder in folders], arguments.archives)
        for folder in folders:
            _check_whole(folder)
        write_pooled(folders, arguments.archives)
        return
    config = _profile(arguments.seed, arguments.root.name)
    archive = arguments.archives / str(arguments.seed)
    if arguments.command == "remaining":
        estimated = arguments.labels and arguments.labels == "estimated"
        print(*remaining(config, archive, estimated), sep="\n")
        return
    missing = write_archive(arguments.root, config, archive)
    print(f"{archive}: {missing} localizers remain" if missing else f"{archive}: whole")


def _profile(seed: int, name: str) -> Config:
    values = merge(*map(read_yaml, PROFILE))
    return parse_config(merge(values, {"seed": seed, "profile": name}), str(PROFILE[-1]))


def _check_announced(names: Sequence[str], archives: Path) -> None:
    """Refuse to pool other replications than were announced, or fewer."""
    if list(names) != [*map(str, ANNOUNCED)]:
        raise InputError(
            archives,
            f"has replications {', '.join(names) or 'none'}; {', '.join(map(str, ANNOUNCED))} were"
            " announced, to be judged together",
            "make the others first, keep further ones elsewhere",
        )


def _check_whole(archive: Path) -> None:
    rest = remaining(_profile(int(archive.name), archive.name), archive)
    if rest:
        raise InputError(archive, f"lacks {rest[0]} and more", "finish that replication first")


if __name__ == "__main__":
    sys.exit(main())
