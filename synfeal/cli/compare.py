"""``synfeal compare``: did a change matter?"""

from __future__ import annotations

import argparse
from pathlib import Path

from synfeal.cli.options import Command, Options

OPTIONS: Options = (
    ("results_a", {"type": Path, "metavar": "RESULTS_A", "help": "results before, e.g. a copy"}),
    ("results_b", {"type": Path, "metavar": "RESULTS_B", "help": "results after: results/mini"}),
    ("--out", {"type": Path, "help": "directory for compare.csv, compare.md and compare.png"}),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from synfeal.report.compare.run import compare  # above this module, as in architecture.md

    print(compare(arguments.results_a, arguments.results_b, arguments.out), end="")
    if arguments.out:
        print(f"\n{arguments.out}: compare.md, compare.png and compare.csv")


COMMAND = Command(
    "compare",
    "two result trees: did a change matter?",
    "Compares two result trees run by run: which errors changed, by how much, with 95 % limits.",
    "synfeal compare before/mini results/mini --out comparison",
    OPTIONS,
    run,
)
