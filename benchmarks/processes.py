"""Processor time of whole processes, starting included."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from synfeal.errors import InputError

ROOT = Path(__file__).resolve().parents[1]


class Taken(NamedTuple):
    """Seconds of one process."""

    cpu: float  # user and system, all threads, by the system's own account
    wall: float


def seconds_of_process(command: Sequence[str | Path]) -> Taken:
    """Run a command in the root of this tree to its end.

    Raises:
        InputError: it failed; what it says stands above.
    """
    began = time.perf_counter()
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise InputError(f"exit status {process.returncode} of {' '.join(map(str, command))}")
    return Taken(usage.ru_utime + usage.ru_stime, time.perf_counter() - began)
