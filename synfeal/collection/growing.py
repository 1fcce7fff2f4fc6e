"""A data set that grows in ``<out>.part`` beside ``<out>`` until it is complete.

Whatever has its final name there is whole. ``.work`` holds what is needed on the way: the settings,
the lock of the command at work, and the prepared scene. When everything is there the directory is
renamed, and then ``.work`` is removed.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from synfeal.errors import Argument, InputError, why
from synfeal.records.files import dotted, read_json, refuse_existing, write_json, writing_to
from synfeal.records.lock import only_command, remove_unfinished

WORK = ".work"
SETTINGS = "settings.json"


@contextmanager
def growing(out: Path, settings: Mapping[str, Any]) -> Iterator[Path | None]:
    """Yield the directory that becomes ``out`` at the end, with what earlier attempts made.

    None where an earlier command was killed when all was there: then ``out`` is complete.

    Args:
        out: Data set to make; it must not exist yet, or be an empty directory.
        settings: What decides its bytes, ready for JSON; earlier attempts must have the same.

    Raises:
        InputError: ``out`` is there already, cannot be written, grows from other settings, or
            another command is at work on it.
        KeyboardInterrupt: with what is kept, for the message.
    """
    out = _place_of(out)
    if _clean_up(out):
        yield None
        return
    refuse_existing(out)
    part = out.with_name(f"{out.name}.part")
    if part.is_dir() and not os.path.lexists(part / WORK / SETTINGS) and _holds_files(part):
        raise InputError(part, "is not an unfinished data set", "delete it or choose another `out`")
    try:
        with writing_to(part, lambda: _kept(part)):
            (part / WORK).mkdir(parents=True, exist_ok=True)
            with only_command(part, part / WORK / "lock"):
                _check_settings(part, settings)
                try:
                    refuse_existing(out)  # by a command that has just ended
                    remove_unfinished(part)
                    yield part
                    part.replace(out)
                finally:
                    if part.is_dir() and not _holds_files(part):
                        shutil.rmtree(part, ignore_errors=True)
            _clean_up(out)
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt(_kept(part)) from interrupt


def _holds_files(part: Path) -> bool:
    return any(path.name != WORK for path in part.iterdir())


def _place_of(out: Path) -> Path:
    """Return ``out`` as an absolute path, to which a directory can be renamed."""
    try:
        place = out.resolve()
        if place.is_mount():
            raise InputError(
                Argument("out"), f"{out} is a whole file system", "name a directory in it"
            )
    except (OSError, RuntimeError) as error:  # a name that is too long; links in a loop
        reason = getattr(error, "strerror", None) or "its links lead in a circle"
        raise InputError(Argument("out"), f"{out}: {reason}", "choose another directory") from error
    return place


def _clean_up(out: Path) -> bool:
    """Remove ``.work`` from a complete data set; tell whether there was one to finish so."""
    was_complete = (out / WORK).is_dir()
    if was_complete:
        shutil.rmtree(out / WORK)
    return was_complete


def _kept(part: Path) -> str:
    if not part.is_dir():
        return "nothing was kept"
    return f"what is done is kept in {part}; run the same command again to go on"


def _check_settings(part: Path, settings: Mapping[str, Any]) -> None:
    """Check that ``part`` was begun with these settings, and write them where there are none."""
    path = part / WORK / SETTINGS
    if not os.path.lexists(path):
        write_json(path, settings)
    try:
        found = read_json(path)
        if not isinstance(found, dict):
            raise ValueError("holds no mapping")
    except (OSError, ValueError) as error:
        raise InputError(
            path, f"cannot be read ({why(error)})", f"delete {part} to start anew"
        ) from error
    before, now = dotted(found), dotted(settings)
    differing = [
        f"`{key}` was {before.get(key)}, is {now.get(key)}"
        for key in {**now, **before}
        if before.get(key) != now.get(key)
    ]
    if differing:
        raise InputError(
            path,
            f"is of another data set ({'; '.join(differing)})",
            f"go on with the options of that one, or delete {part} to start anew",
        )
