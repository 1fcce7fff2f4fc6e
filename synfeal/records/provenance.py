"""Provenance of a result: commit, configuration, seeds, versions and machine."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

import synfeal

PACKAGES = (
    "embreex",
    "gtsam",
    "moderngl",
    "numpy",
    "open3d",
    "pycolmap",
    "pyrender",
    "scipy",
    "synfeal",
    "torch",
    "trimesh",
)
DRAWING = ("deflate", "embreex", "moderngl", "numpy", "pillow", "pyrender", "trimesh")
UNKNOWN = "unknown"
CPU_INFO = Path("/proc/cpuinfo")


def seed_of(*components: object) -> int:
    """Hash the components alone to a 63-bit seed, e.g. ``seed_of(7, "large_room", "train")``.

    Adding a model or a scene never shifts the random numbers of another.
    """
    text = "\x1f".join(map(str, components))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big") >> 1


def generator_of(*components: object) -> np.random.Generator:
    """Make a NumPy generator seeded by :func:`seed_of`."""
    return np.random.default_rng(seed_of(*components))


def provenance(seed: int, config_hash: str) -> dict[str, Any]:
    """Return commit, seed, versions and machine as a mapping ready for JSON."""
    return {
        "commit": git_commit(Path(__file__).parent),
        "config_sha256": config_hash,
        "seed": seed,
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "cpus": os.cpu_count(),
        "time_utc": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def frame_versions() -> dict[str, str]:
    """Collect the versions that decide what frames look like; renderers need not be installed."""
    found = {name: _version(name) for name in DRAWING if _version(name) != UNKNOWN}
    return {"synfeal": synfeal.__version__, **found}


def config_hash(model: BaseModel) -> str:
    """Hash a configuration (SHA-256): equal values, equal hash, in any order of keys."""
    text = json.dumps(model.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def git_commit(folder: Path) -> str:
    """Return the commit checked out around ``folder``, with ``-dirty`` if tracked files changed.

    Changed results do not count: publishing one run must not mark the next one.
    ``unknown`` without git, and where no repository tracks the folder: an installed package has no
    commit, though its environment may stand in somebody's repository.
    """
    tracked = _git(folder, "ls-files")
    if tracked is None or tracked.returncode or not tracked.stdout:
        return UNKNOWN
    commit = _git(folder, "rev-parse", "HEAD")
    if commit is None or commit.returncode:
        return UNKNOWN
    changed = _git(folder, "diff", "--quiet", "HEAD", "--", ":(top)", ":(top,exclude)results")
    clean = changed is not None and changed.returncode == 0
    return commit.stdout.strip() + ("" if clean else "-dirty")


def processor_name(cpu_info: Path) -> str:
    """Return the processor's model as the kernel names it, or else as Python does."""
    try:
        lines = cpu_info.read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next(iter(names), platform.processor() or platform.machine() or UNKNOWN)


def _git(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str] | None:
    command = ["git", "-C", str(folder), *arguments]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return UNKNOWN
