"""The directory a data set grows in: ``<out>.part`` beside ``<out>``, until it is complete.

::

    <out>.part/job.json    which job it belongs to
    <out>.part/lock        held by the commands that work on it
    <out>.part/tmp-*/      files being written
    <out>.part/data/       what becomes <out>: plan first, then frames, then the rest

It appears with its plan, by a rename; so does every file in ``data``. Whenever a command is
killed, what stands in ``data`` is whole, and the next command goes on from there.
"""

from __future__ import annotations

import fcntl
import json
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from synfeal.dataset.collect_job import differences
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.files import read_json, write_json

Plans = dict[str, PoseTable]
JOB, LOCK, DATA, TEMPORARY = "job.json", "lock", "data", "tmp-"


def unfinished_of(out: Path) -> Path:
    """Where the data set ``out`` grows."""
    out = out.resolve()
    return out.with_name(f"{out.name}.part")


def open_unfinished(out: Path, record: Mapping[str, Any], plan: Callable[[], Plans]) -> Path:
    """The unfinished directory of ``out``; made with its plan where there is none yet.

    Two commands that start at once agree on the plan of the one that was first.

    Raises:
        InputError: it belongs to another job, or nothing can be planned.
    """
    part = unfinished_of(out)
    if not part.exists():
        _make(part, record, plan())
    _check_job(part, record)
    return part


def read_plans(part: Path, splits: Mapping[str, int]) -> Plans:
    """The plans of the splits that have frames.

    Raises:
        InputError: a plan is damaged.
    """
    plans = {split: read_pose_table(part / DATA / f"{split}.csv") for split in splits}
    for split, count in splits.items():
        if len(plans[split]) != count:
            raise InputError(f"{part}: {split}.csv is damaged; delete the directory and start anew")
    return plans


def finish(part: Path, out: Path) -> None:
    """Give the complete data set its name and remove what it grew in."""
    (part / DATA).replace(out)
    remove_remains(out)


def remove_remains(out: Path) -> bool:
    """Remove what a command leaves that was killed after ``out`` was complete; whether it was."""
    part = unfinished_of(out)
    if not out.is_dir() or not (part / JOB).is_file() or (part / DATA).exists():
        return False
    shutil.rmtree(part)
    return True


@contextmanager
def locked(part: Path, alone: bool) -> Iterator[None]:
    """Keep others away: all of them, or those that want to be alone. A lock ends with its process.

    Raises:
        InputError: another command is at work.
    """
    with (part / LOCK).open("a") as file:
        try:
            fcntl.flock(file, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"{part}: another command is at work on it; wait for its end"
            ) from None
        yield


@contextmanager
def scratch(part: Path) -> Iterator[Path]:
    """A directory for files that are being written."""
    with tempfile.TemporaryDirectory(
        prefix=TEMPORARY, dir=part, ignore_cleanup_errors=True
    ) as path:
        yield Path(path)


def remove_temporary(part: Path) -> None:
    """Remove what commands that were killed left half-written; no other may be at work."""
    for path in part.glob(f"{TEMPORARY}*"):
        shutil.rmtree(path)
    for path in part.parent.glob(f"{part.name}-{TEMPORARY}*"):
        shutil.rmtree(path)
    for path in (part / DATA).glob(".*"):  # of synfeal.files.atomic_path
        path.unlink()


def _make(part: Path, record: Mapping[str, Any], plans: Plans) -> None:
    part.parent.mkdir(parents=True, exist_ok=True)
    new = Path(tempfile.mkdtemp(prefix=f"{part.name}-{TEMPORARY}", dir=part.parent))
    try:
        write_json(new / JOB, record)
        for split, table in plans.items():
            write_pose_table(new / DATA / f"{split}.csv", table)
        new.chmod(0o755)
        new.replace(part)
    except OSError:
        if not (part / JOB).is_file():  # else another command was first
            raise
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _check_job(part: Path, record: Mapping[str, Any]) -> None:
    try:
        found = read_json(part / JOB)
        if not isinstance(found, dict):
            raise ValueError(f"{JOB} holds no mapping")
    except (OSError, ValueError) as error:
        raise InputError(
            f"{part}: no unfinished data set ({error}); delete it or choose another --out"
        ) from None
    differing = differences(found, json.loads(json.dumps(record)))
    if differing:
        raise InputError(
            f"{part}: belongs to another data set ({'; '.join(differing)}); go on with the options"
            f" of that one, or delete {part} to start anew"
        )
