"""One command at a time in a directory, and nothing left there of those that were killed."""

from __future__ import annotations

import os
import re
import shutil
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from synfeal.errors import InputError
from synfeal.records.files import UNFINISHED, unfinished_prefix

LOCK = ".lock"
# Names of :func:`synfeal.records.files.unfinished_prefix`.
TEMPORARY = re.compile(rf"{re.escape(UNFINISHED)}-(?P<host>[\w.]+)-(?P<process>\d+)-.+")
# A job on another machine writes its files more often than that.
ABANDONED_S = 24 * 3600.0
# Locks of runs, which the system releases when this process ends.
_held_to_the_end: list[FileLock] = []


def begin_run(root: Path) -> None:
    """Keep other runs out of ``root`` until this process ends; put in order what earlier ones left.

    The system frees the lock when the process ends, however it ends: nothing has to be unlocked, as
    after Snakemake's own (https://github.com/snakemake/snakemake/issues/2919). What is not finished
    is removed, and no file stays dated in the future.

    Raises:
        InputError: another run is at work there, or nothing can be written there.
    """
    try:
        root.mkdir(parents=True, exist_ok=True)
        _held_to_the_end.append(_lock(root / LOCK))
        _end_future(root)
    except OSError as error:
        raise InputError(
            error.filename or root, f"{error.strerror}; nothing was started"
        ) from error
    remove_unfinished(root)


@contextmanager
def only_command(directory: Path, lock: Path) -> Iterator[None]:
    """Keep other commands out of ``directory`` during the block, by a lock on the file ``lock``.

    The file is there during the block alone.

    Raises:
        InputError: Another command holds the lock.
        OSError: The file cannot be created.
    """
    held = _lock(lock, directory)
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)  # while it is held: nobody else can have taken it
        held.release()


def remove_unfinished(root: Path) -> None:
    """Remove what killed processes left below ``root`` under the names of what is not finished.

    What a process of this machine is still writing stays, and of other machines' what was touched
    within a day: jobs of a killed run may go on elsewhere.
    """
    for folder, directories, files in os.walk(root):
        for name in (*directories, *files):
            path, found = Path(folder, name), TEMPORARY.fullmatch(name)
            if found is None or not _abandoned(path, found["host"], int(found["process"])):
                continue
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def _abandoned(path: Path, host: str, process: int) -> bool:
    """Tell whether nobody writes a temporary file any more."""
    if unfinished_prefix("").startswith(f"{UNFINISHED}-{host}-"):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        except PermissionError:
            pass  # somebody else's process
        return False
    try:
        return time.time() - path.lstat().st_mtime > ABANDONED_S
    except FileNotFoundError:  # it has just been finished
        return False


def _end_future(root: Path) -> None:
    """Set to now, in order, the times of files that lie in the future after a clock jumped back.

    Snakemake fails every job that reads a file younger than what the job writes.
    """
    now_ns = time.time_ns()
    dates_ns = {path: path.lstat().st_mtime_ns for path in root.rglob("*") if path.is_file()}
    future = {path: date_ns for path, date_ns in dates_ns.items() if date_ns > now_ns}
    rank = {date_ns: rank for rank, date_ns in enumerate(sorted(set(future.values())))}
    for path, date_ns in future.items():
        new_ns = now_ns + rank[date_ns] * 1000  # dates are compared as floats: 1 µs is kept apart
        os.utime(path, ns=(new_ns, new_ns), follow_symlinks=False)
    if future:
        print(f"{root}: {len(future)} files dated in the future are now dated now", file=sys.stderr)


def _lock(path: Path, directory: Path | None = None) -> FileLock:
    """Lock a file, and write into it who holds the lock.

    Args:
        path: The file, created where it is missing.
        directory: Named in messages; the folder of ``path`` by default.

    Returns:
        The lock, held until it is released, is garbage, or the process ends.

    Raises:
        InputError: Another process holds the lock.
        OSError: The file cannot be created.
    """
    directory = directory or path.parent
    path.touch(0o644)
    lock = FileLock(path, timeout=0, fallback_to_soft=False)
    try:
        lock.acquire()
    except Timeout as error:
        holder = path.read_text(errors="replace") or "it did not say which"
        raise InputError(
            directory, f"another run is at work there ({holder}); wait for its end, or end it"
        ) from error
    except OSError as error:  # some network file systems know no locks
        print(f"{path}: {error.strerror}; see yourself that no other run starts", file=sys.stderr)
    else:
        path.write_text(f"process {os.getpid()} on {socket.gethostname()}")
    return lock
