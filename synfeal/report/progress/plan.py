"""What a run is going to do: which jobs, how long each may take, and which scores come of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from synfeal.config import Config, Design, Experiment, Run
from synfeal.errors import InputError
from synfeal.report.cost.dry_run import key_of
from synfeal.report.cost.jobs import Profile, jobs_of
from synfeal.report.cost.laws import fit_laws, seconds_of
from synfeal.report.cost.profiles import read_run

MEASURED = Path("results/published/mini")


@dataclass(frozen=True)
class RunPlan:
    """What the workflow tells of a run at its start.

    Attributes:
        root: results of the profile.
        expected_s: seconds each job that is to run may take, by ``stage/name`` as in
            ``<root>/benchmarks``.
        runs: training runs of the design, whether they are to run or have run.
        cores: jobs at a time.
    """

    root: Path
    expected_s: Mapping[str, float]
    runs: tuple[Run, ...]
    cores: int


def plan_run(
    config: Config, experiments: tuple[Experiment, ...], benchmarks: Iterable[str], cores: int
) -> RunPlan:
    """The plan of a run.

    Args:
        config: the profile.
        experiments: its design.
        benchmarks: ``<root>/benchmarks/<stage>/<name>.tsv`` of the jobs that are to run.
        cores: jobs at a time.
    """
    paths = list(benchmarks)
    known = _expected_s(Profile(config, experiments), paths)
    usual = median(known.values()) if known else 1.0
    expected_s = {job: known.get(job, usual) for job in map(job_name, paths)}
    design = Design(rows=experiments, repetitions=config.training.repetitions)
    return RunPlan(config.root, expected_s, tuple(design.runs), cores)


def job_name(benchmark: str) -> str:
    """``stage/name`` of a job, from the file that measures it."""
    return benchmark.partition("/benchmarks/")[2].removesuffix(".tsv")


def _expected_s(profile: Profile, benchmarks: Iterable[str]) -> dict[str, float]:
    """Seconds by job from the planner's laws (docs/cost.md); none where no run was published."""
    try:
        laws = fit_laws(read_run(MEASURED)[0])
    except InputError:
        return {}
    jobs = jobs_of(profile, filter(None, map(key_of, benchmarks)))
    names = jobs["stage"].str.cat(jobs["job"], sep="/").str.rstrip("/")
    return dict(seconds_of(jobs, laws).set_axis(names).dropna())
