"""Profiles and the jobs that Snakemake plans for them: asked once in a process of tests."""

from __future__ import annotations

import contextlib
from functools import cache
from pathlib import Path

import pandas as pd

from synfeal.report.cost.dry_run import PlannedJobs, planned_jobs
from synfeal.report.cost.jobs import Profile, jobs_of
from synfeal.report.cost.profiles import profile_path, read_profile

ROOT = Path(__file__).parent.parent


@cache
def planned(name: str) -> tuple[Profile, PlannedJobs]:
    """A profile and the jobs of a run of it."""
    with contextlib.chdir(ROOT):
        return read_profile(name), planned_jobs(profile_path(name))


def run_jobs(name: str) -> pd.DataFrame:
    """The jobs with their sizes."""
    profile, jobs = planned(name)
    return jobs_of(profile, jobs.keys)
