"""Profiles by name or file, and the runs that were made with them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from baselines.groundtruth.methods import check_sources
from synfeal.config import load_config, read_design
from synfeal.config.load import read_yaml
from synfeal.errors import InputError
from synfeal.report.cost.jobs import Profile, jobs_of
from synfeal.report.cost.laws import matched
from synfeal.report.cost.measured import read_measured

FOLDER = Path("config")
DEFAULT = FOLDER / "config.yaml"


def read_profile(name: str) -> Profile:
    """A profile by its name in a file of ``config/``, or by the path of its file."""
    path = profile_path(name)
    paths = [path] if is_default(path) else [DEFAULT, path]
    config = load_config(*paths)
    design = read_design(config)
    check_sources(design.rows, config.experiments)
    return Profile(config, design)


def is_default(path: Path) -> bool:
    """Whether it is the file that all others go over; links may form a circle."""
    return os.path.realpath(path) == os.path.realpath(DEFAULT)


def profile_path(name: str) -> Path:
    """The file of a profile, by name or path."""
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    found = {str(read_yaml(p).get("profile")): p for p in sorted(FOLDER.glob("*.yaml"))}
    if name not in found:
        known = ", ".join(sorted(found)) or "none"
        raise InputError(f"profile '{name}': no such profile in {FOLDER}/; known: {known}")
    return found[name]


def read_run(root: Path) -> tuple[pd.DataFrame, int]:
    """Measured jobs of a run with their sizes, and how many the profile cannot have.

    The run's directory is called like its profile, as the workflow calls it.
    """
    measured = read_measured(root)
    profile = read_profile(root.resolve().name)
    keys = zip(measured["stage"], measured["job"], strict=True)
    pairs = matched(jobs_of(profile, keys), measured)
    if pairs.empty:
        raise InputError(f"{root}: none of its measured jobs is one of the profile's")
    return pairs, len(measured) - len(pairs)


def read_runs(roots: Sequence[Path]) -> tuple[pd.DataFrame, int]:
    """The same of several runs together."""
    runs = [read_run(root) for root in roots]
    return pd.concat([pairs for pairs, _ in runs]), sum(left for _, left in runs)
