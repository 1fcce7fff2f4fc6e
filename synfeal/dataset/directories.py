"""Directories that appear complete or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from synfeal.errors import InputError


def refuse_existing(path: Path) -> None:
    """Refuse to write where there is something already."""
    if path.is_symlink() and not path.exists():
        raise InputError(f"{path}: is a link that leads nowhere; choose another directory")
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise InputError(f"{path}: exists and is not empty; delete it or choose another directory")


def refuse_foreign(out: Path, own: Collection[str], origin: str) -> None:
    """Refuse a directory with anything but what an earlier command of the same kind wrote.

    ``own`` names the files that may be replaced; ``origin`` says what writes them, as in "is not
    from a comparison".
    """
    if os.path.lexists(out) and not out.is_dir():
        raise InputError(f"{out}: is a file; choose another directory with --out")
    others = sorted(path.name for path in out.glob("*") if path.name not in own)
    if others:
        raise InputError(
            f"{out}: holds '{others[0]}', which is not from {origin}; choose another directory"
            " with --out"
        )


@contextmanager
def writing_to(path: Path, remedy: Callable[[], str]) -> Iterator[None]:
    """Say in one line that a file could not be written: a full disk, a read-only one.

    Names ``path`` where the system names no file, and what to do then.

    Raises:
        InputError: in place of any OSError.
    """
    try:
        yield
    except OSError as error:
        name, reason = error.filename or path, error.strerror or error
        raise InputError(f"{name}: {reason}; {remedy()}") from error


@contextmanager
def atomic_directory(path: Path) -> Iterator[Path]:
    """A temporary directory beside ``path`` that is renamed to it if the block succeeds."""
    path = Path(path)
    refuse_existing(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(prefix=f".{path.name}-", dir=path.parent))
    try:
        yield temporary
        temporary.chmod(0o755)
        temporary.replace(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
