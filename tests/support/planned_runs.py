"""Profiles and the jobs that Snakemake plans for them: asked once in a process of tests."""

import contextlib
from functools import cache

from reproduction.plan.dry_run import planned_jobs
from reproduction.plan.jobs import jobs_of
from reproduction.plan.runs import profile_path, read_profile
from tests import ROOT


@cache
def planned(name):
    """A profile and the jobs of a run of it."""
    with contextlib.chdir(ROOT):
        return read_profile(name), planned_jobs(profile_path(name))


def run_jobs(name):
    """The jobs with their sizes."""
    profile, jobs = planned(name)
    return jobs_of(profile, jobs.keys)
