"""Complete results with a disk of their own on top: what is written there can be made to fail."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.workflow_faults.session import RESULTS

LARGE = "2g"


@contextmanager
def over(calm: Path, place: Path) -> Iterator[Path]:
    """The results of ``calm`` appear in the copy ``place``, on a file system in memory; needs root.

    Yields:
        The directory of that file system, for :func:`fill` and :func:`make_room`.
    """
    disk, merged = place / "disk", place / RESULTS
    shutil.rmtree(place / ".snakemake", ignore_errors=True)
    shutil.copytree(calm / ".snakemake", place / ".snakemake")
    for folder in (disk, merged):
        folder.mkdir(parents=True, exist_ok=True)
    _do("mount", "-t", "tmpfs", "-o", f"size={LARGE}", "tmpfs", str(disk))
    try:
        upper, work = disk / "upper", disk / "work"
        upper.mkdir()
        work.mkdir()
        layers = f"lowerdir={calm / RESULTS},upperdir={upper},workdir={work}"
        _do("mount", "-t", "overlay", "-o", layers, "overlay", str(merged))
        try:
            yield disk
        finally:
            _do("umount", "--lazy", str(merged))
    finally:
        _do("umount", "--lazy", str(disk))


def remove(root: Path, names: tuple[str, ...]) -> None:
    """Remove files and directories, by their paths below ``root``, as if never made."""
    for name in names:
        if (root / name).is_dir():
            shutil.rmtree(root / name)
        else:
            (root / name).unlink()


def fill(disk: Path) -> None:
    """Leave no room at all."""
    with (disk / "filler").open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(1 << 20))
        except OSError:
            return


def make_room(disk: Path) -> None:
    """What filled the disk is gone."""
    (disk / "filler").unlink()


def _do(*command: str) -> None:
    subprocess.run(command, check=True)
