"""Profiles, and what the jobs of a run took: from Snakemake's benchmark files.

Tables of jobs have the columns of ``<root>/benchmarks.csv``: ``stage`` and ``job``, folder or file
below ``<root>/benchmarks`` and path below that, without ``.tsv``; ``wall_s`` from start to end;
``cpu_s`` of the processor; ``peak_mb``, largest resident memory, NaN where a job was too short.
"""

from __future__ import annotations

import os
from pathlib import Path

import pandas as pd

from reproduction.config.load import load_config
from reproduction.design.experiments import design_name, read_design
from reproduction.design.labels import check_sources
from reproduction.plan.jobs import Profile, jobs_of
from reproduction.plan.laws import matched
from reproduction.runs.job_times import read_measured
from synfeal.config.load import read_yaml
from synfeal.errors import InputError

FOLDER = Path("config")
DEFAULT = FOLDER / "config.yaml"


def read_profile(name: str) -> Profile:
    """Read a profile by its name in ``config/``, or by the path of its file."""
    path = profile_path(name)
    paths = [path] if is_default(path) else [DEFAULT, path]
    config = load_config(*paths)
    design = read_design(config)
    check_sources(design.rows, design_name(config))
    return Profile(config, design)


def is_default(path: Path) -> bool:
    """Tell whether a file is the one that all others extend; links may form a circle."""
    return os.path.realpath(path) == os.path.realpath(DEFAULT)


def profile_path(name: str) -> Path:
    """Return the file of a profile, by name or path."""
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    paths = sorted(FOLDER.glob("*.yaml"))
    found = {str(read_yaml(path).get("profile", path.stem)): path for path in paths}
    if name not in found:
        known = ", ".join(sorted(found)) or "none"
        raise InputError(f"profile '{name}': no such profile in {FOLDER}/; known: {known}")
    return found[name]


def read_runs(*roots: Path) -> tuple[pd.DataFrame, int]:
    """Read measured jobs of runs with their sizes; count those their profiles cannot have.

    A run's directory is called like its profile, as the workflow calls it.
    """
    parts, left = [], 0
    for root in roots:
        measured = read_measured(root)
        profile = read_profile(root.resolve().name)
        keys = zip(measured["stage"], measured["job"], strict=True)
        parts.append(matched(jobs_of(profile, keys), measured))
        left += len(measured) - len(parts[-1])
        if parts[-1].empty:
            raise InputError(f"{root}: none of its measured jobs is one of the profile's")
    return pd.concat(parts), left
