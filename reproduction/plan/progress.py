"""Remaining work of a run, and the time it takes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from reproduction.config.profile import Config
from reproduction.design.experiments import Design, Run
from reproduction.plan.dry_run import job_name, key_of
from reproduction.plan.jobs import Profile, jobs_of
from reproduction.plan.laws import fit_laws, seconds_of
from reproduction.plan.runs import read_runs
from synfeal.errors import InputError

MEASURED = Path("results/published/mini")


@dataclass(frozen=True)
class RunPlan:
    """Announcement of the workflow at the start of a run."""

    root: Path  # results of the profile
    # Seconds each job that is to run may take, by ``stage/name`` as in ``<root>/benchmarks``.
    expected_s: Mapping[str, float]
    runs: tuple[Run, ...]  # training runs of the design, whether they are to run or have run
    cores: int  # jobs at a time


def plan_run(config: Config, design: Design, benchmarks: Iterable[str], cores: int) -> RunPlan:
    """Plan a run on ``cores`` whose jobs write ``<root>/benchmarks/<stage>/<name>.tsv``."""
    paths = list(benchmarks)
    known = _expected_s(Profile(config, design), paths)
    usual = median(known.values()) if known else 1.0
    expected_s = {job: known.get(job, usual) for job in map(job_name, paths)}
    return RunPlan(config.root, expected_s, tuple(design.runs), cores)


def to_do(measured: Mapping[str, Sequence[str]], counts: Mapping[str, int]) -> list[str]:
    """Choose the jobs that a run most likely does.

    Args:
        measured: By rule, the file of each of its jobs that Snakemake writes what it took to.
        counts: Jobs that Snakemake says it is going to do, by rule.

    Returns:
        As many of these files as there are jobs to do, those that are not there yet first.
    """
    chosen = []
    for rule, paths in measured.items():
        by_need = sorted(paths, key=lambda path: Path(path).exists())
        chosen += by_need[: counts.get(rule, 0)]
    return chosen


def _expected_s(profile: Profile, benchmarks: Iterable[str]) -> dict[str, float]:
    """Predict seconds by job by the planner's laws (docs/cost.md); none without a published run."""
    try:
        laws = fit_laws(read_runs(MEASURED)[0])
    except InputError:
        return {}
    jobs = jobs_of(profile, map(key_of, benchmarks))
    names = jobs["stage"].str.cat(jobs["job"], sep="/").str.rstrip("/")
    return dict(seconds_of(jobs, laws).set_axis(names).dropna())


# So many expected seconds count as much as what was measured: the first short jobs, which mostly
# wait for the disk, do not decide what hours of training will take.
TRUSTED_S = 60.0


class TimeLeft:
    """Time left of a run on ``cores``, from what its jobs (``stage/name``) were expected to take.

    The ratio of measured to expected seconds is known for the whole run and for each stage; both
    start at what is expected (the stages at the ratio of the run), with a weight of ``TRUSTED_S``.
    One thread may ask while another tells: what changes is copied before it is gone through.
    """

    def __init__(self, expected_s: Mapping[str, float], cores: int) -> None:
        self.expected_s = dict(expected_s)
        self._cores = max(cores, 1)
        self._began: dict[str, float] = {}
        self._taken_s: dict[str, float] = {}

    def started(self, job: str, now_s: float) -> None:
        """Note that a job began; if unexpected, it replaces an expected one of its stage."""
        self._began[job] = now_s
        if job not in self.expected_s:
            begun = self._began.keys() | self._taken_s.keys()
            waiting = (other for other in self.expected_s if other not in begun)
            instead = next((other for other in waiting if _stage(other) == _stage(job)), None)
            if instead is not None:
                self.expected_s = {
                    job if other == instead else other: seconds
                    for other, seconds in self.expected_s.items()
                }

    def finished(self, job: str, now_s: float) -> None:
        """Note that a job ended."""
        self._taken_s[job] = now_s - self._began.pop(job, now_s)
        self.expected_s.setdefault(job, self._taken_s[job])

    @property
    def running(self) -> tuple[str, ...]:
        """Jobs that began and did not end, in that order."""
        return tuple(self._began)

    def count(self, stage: str) -> tuple[int, int]:
        """Return how many jobs of a stage are done, and how many it has."""
        jobs = [job for job in tuple(self.expected_s) if _stage(job) == stage]
        return sum(job in self._taken_s for job in jobs), len(jobs)

    def seconds(self, now_s: float) -> float:
        """Return the seconds left: the work there is on all cores, or the longest job on one."""
        left = list(self._left_s(now_s).values())
        return max(sum(left) / self._cores, max(left, default=0.0))

    def share(self) -> float:
        """Return the part of the expected work that is done, from 0 to 1; it never falls."""
        expected_s = dict(self.expected_s)
        done_s = sum(expected_s[job] for job in tuple(self._taken_s))
        return done_s / sum(expected_s.values()) if expected_s else 1.0

    def _left_s(self, now_s: float) -> dict[str, float]:
        expected_s: dict[str, float] = defaultdict(float)  # of finished jobs, by stage
        taken_s: dict[str, float] = defaultdict(float)
        for job, seconds in tuple(self._taken_s.items()):
            expected_s[_stage(job)] += self.expected_s[job]
            taken_s[_stage(job)] += seconds
        ratio = (sum(taken_s.values()) + TRUSTED_S) / (sum(expected_s.values()) + TRUSTED_S)
        left = {}
        for job, seconds in tuple(self.expected_s.items()):
            if job not in self._taken_s:
                stage = _stage(job)
                factor = (taken_s[stage] + ratio * TRUSTED_S) / (expected_s[stage] + TRUSTED_S)
                left[job] = max(seconds * factor - (now_s - self._began.get(job, now_s)), 0.0)
        return left


def _stage(job: str) -> str:
    return job.partition("/")[0]
