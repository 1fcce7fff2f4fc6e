"""The command ``synfeal``.

Nothing is imported here that takes long, so that :mod:`synfeal.cli.program` is soon reached.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; return 0, 1 for what a person can fix, 2 for wrong usage, 130 after Ctrl-C."""
    from synfeal.errors import exit_status

    if isinstance(sys.stdout, io.TextIOWrapper):
        # What a terminal has no letter for is written by its number; the work is not lost by it.
        sys.stdout.reconfigure(errors="backslashreplace")

    def act() -> None:
        from synfeal.cli.parser import run

        try:
            run(argv)
        except SystemExit:  # after help
            sys.stdout.flush()
            raise
        sys.stdout.flush()

    return exit_status(act, "what was not finished was not kept")
