"""The one exception that is meant for people, and what entry points make of it."""

from __future__ import annotations

import sys
from collections.abc import Callable

LONGEST = 900  # characters of a message


class InputError(Exception):
    """Something a person gave us cannot be used.

    The message is one line that names the file and the field and says what to do. Entry points
    print it without a traceback and exit with status 1; every other exception is a defect and keeps
    its traceback.
    """

    def __init__(self, message: str) -> None:
        line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
        if len(line) > LONGEST:  # what a file holds is quoted in part; the remedy stands at the end
            line = f"{line[: LONGEST - 200]} ... {line[-190:]}"
        super().__init__(line)


def exit_status(action: Callable[[], object], if_interrupted: str) -> int:
    """Carry out ``action``: 0, or 1 with ``error: ...`` for what a person can fix.

    That is an :class:`InputError`, and what the system refuses: a full or read-only disk, a name
    that is too long, links that lead in a circle.

    Args:
        action: what a command does.
        if_interrupted: what Ctrl-C leaves behind, for the message of exit status 130, unless the
            ``KeyboardInterrupt`` says it itself.
    """
    try:
        action()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        if error.strerror is None:  # of no system call: a defect
            raise
        place = f"{error.filename}: " if error.filename else ""
        print(f"error: {InputError(f'{place}{error.strerror}; {if_interrupted}')}", file=sys.stderr)
        return 1
    except KeyboardInterrupt as interrupt:
        print(f"error: interrupted; {str(interrupt) or if_interrupted}", file=sys.stderr)
        return 130
    return 0
