"""The directory a data set grows in: ``<out>.part`` beside ``<out>``, until it is complete.

What stands there under its final name is whole. ``.work`` holds what is needed on the way: the
settings, the lock of the command at work, and the prepared scene. When all is there the directory
is renamed, and then ``.work`` goes.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from synfeal.dataset.directories import refuse_existing, writing_to
from synfeal.errors import InputError, why
from synfeal.files import read_json, write_json
from synfeal.run_lock import only_command, remove_unfinished

WORK = ".work"
SETTINGS, LOCK = "settings.json", "lock"


@contextmanager
def growing(out: Path, settings: Mapping[str, Any]) -> Iterator[Path]:
    """The directory that becomes ``out`` when the block ends, with what earlier commands made.

    ``out`` is from :func:`place_of`, and must not exist yet or be an empty directory; ``settings``
    are what decides its bytes, ready for JSON, and another command's must be the same.

    Raises:
        InputError: ``out`` is there already, cannot be written, grows from other settings, or
            another command is at work on it.
        KeyboardInterrupt: with what is kept, for the message.
    """
    refuse_existing(out)
    part = out.with_name(f"{out.name}.part")
    if part.is_dir() and not os.path.lexists(part / WORK / SETTINGS) and _holds_files(part):
        raise InputError(
            f"{part}: is not an unfinished data set; delete it or choose another --out"
        )
    try:
        with writing_to(part, lambda: _kept(part)):
            (part / WORK).mkdir(parents=True, exist_ok=True)
            with only_command(part, part / WORK / LOCK):
                check_settings(part, settings)
                try:
                    refuse_existing(out)  # by a command that has just ended
                    remove_unfinished(part)
                    yield part
                    part.replace(out)
                finally:
                    if part.is_dir() and not _holds_files(part):
                        shutil.rmtree(part, ignore_errors=True)
            clean_up(out)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_kept(part)) from None


def _holds_files(part: Path) -> bool:
    return any(path.name != WORK for path in part.iterdir())


def place_of(out: Path) -> Path:
    """``out`` as an absolute path.

    Raises:
        InputError: nothing can be renamed to it.
    """
    try:
        place = out.resolve()
        if place.is_mount():
            raise InputError(f"--out: {out} is a whole file system; name a directory in it")
    except (OSError, RuntimeError) as error:  # a name that is too long; links in a loop
        reason = getattr(error, "strerror", None) or "its links lead in a circle"
        raise InputError(f"--out: {out}: {reason}; choose another directory") from None
    return place


def clean_up(out: Path) -> bool:
    """Finish what a command left that was killed when ``out`` was complete; whether it was."""
    was_complete = (out / WORK).is_dir()
    if was_complete:
        shutil.rmtree(out / WORK)
    return was_complete


def _kept(part: Path) -> str:
    if not part.is_dir():
        return "nothing was kept"
    return f"what is done is kept in {part}; run the same command again to go on"


def check_settings(part: Path, settings: Mapping[str, Any]) -> None:
    """Whether ``part`` was begun with the same settings; they are written where there are none."""
    path = part / WORK / SETTINGS
    if not os.path.lexists(path):
        write_json(path, settings)
    try:
        found = read_json(path)
        if not isinstance(found, dict):
            raise ValueError("holds no mapping")
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path}: cannot be read ({why(error)}); delete {part} to start anew"
        ) from None
    differing = differences(found, settings)
    if differing:
        raise InputError(
            f"{path}: is of another data set ({'; '.join(differing)}); go on with the options of"
            f" that one, or delete {part} to start anew"
        )


def differences(found: Mapping[str, Any], asked: Mapping[str, Any]) -> list[str]:
    """What two records disagree on, one phrase each, in the order of ``asked``."""
    before, now = dict(_flat(found)), dict(_flat(asked))
    return [
        f"{key} was {before.get(key)}, is {now.get(key)}"
        for key in {**now, **before}
        if before.get(key) != now.get(key)
    ]


def _flat(record: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Nested keys joined by dots."""
    for key, value in record.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
