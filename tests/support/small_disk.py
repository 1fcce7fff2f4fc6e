"""A disk that is too small: a file system in memory that tests mount, fill and enlarge."""

import subprocess
from contextlib import contextmanager

import pytest


@contextmanager
def mounted(disk, size):
    """A file system of its own in the new directory ``disk``, e.g. of ``64k``."""
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("only root may mount a small disk")
    try:
        yield disk
    finally:
        subprocess.run(["umount", "--lazy", str(disk)], check=True)


def remount(disk, option):
    """Change its size (``size=50m``) or mode (``ro``)."""
    subprocess.run(["mount", "-o", f"remount,{option}", str(disk)], check=True)
