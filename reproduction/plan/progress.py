"""Progress of a run: one line with jobs done, rules at work, rate and time left."""

from __future__ import annotations

import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from reproduction.design.files import Files
from reproduction.plan.jobs import jobs_of
from reproduction.plan.pace import paces_of, read_run, seconds_of
from reproduction.plan.text import duration, number
from reproduction.runs.published import MEASURED
from synfeal.errors import InputError

# So many expected seconds count as much as what was measured: the first short jobs, which mostly
# wait for the disk, do not decide what hours of training will take.
TRUSTED_S = 60.0
INTERVAL_S = 60.0  # between lines where there is no terminal
BAR_CELLS, LOG_LINES, RULES_SHOWN = 20, 20, 2


def seconds_by_rule(files: Files) -> dict[str, float]:
    """Predict what a job of each rule takes on average; empty where no run was published."""
    try:
        paces = paces_of(map(read_run, MEASURED))
    except InputError:
        return {}
    jobs = jobs_of(files)
    return dict(seconds_of(jobs, paces).groupby(jobs["rule"]).mean().dropna())


class TimeLeft:
    """Time left of a run, from what jobs were expected to take and what they took.

    One thread may ask while another tells: what changes is copied before it is gone through.

    Args:
        counts: Jobs of the run, by rule.
        expected_s: Seconds that a job is expected to take, by rule; where that is not known, the
            median of the others.
        cores: Jobs at a time.
    """

    def __init__(
        self, counts: Mapping[str, int], expected_s: Mapping[str, float], cores: int
    ) -> None:
        usual_s = median(expected_s.values()) if expected_s else 1.0
        self.counts = dict(counts)
        self._expected_s = {rule: expected_s.get(rule, usual_s) for rule in counts}
        self._cores = max(cores, 1)
        self._began: dict[int, tuple[str, float]] = {}
        self._taken_s: dict[str, float] = defaultdict(float)
        self.done: Counter[str] = Counter()

    def started(self, job: int, rule: str, now_s: float) -> None:
        """Note that a job began.

        Args:
            job: Number of the job in this run.
            rule: Rule it belongs to.
            now_s: Seconds of a monotonic clock.
        """
        self._began[job] = rule, now_s

    def finished(self, job: int, now_s: float) -> None:
        """Note that a job ended, well or not."""
        if job in self._began:
            rule, began_s = self._began.pop(job)
            self._taken_s[rule] += now_s - began_s
            self.done[rule] += 1

    @property
    def running(self) -> list[str]:
        """Rules at work, in the order in which their jobs began."""
        return list(dict.fromkeys(rule for rule, _ in tuple(self._began.values())))

    def seconds(self, now_s: float) -> float:
        """Estimate the seconds left: all work on all cores, or the longest job on one."""
        done, taken_s = Counter(self.done), dict(self._taken_s)
        began = tuple(self._began.values())
        expected_s = {rule: n * self._expected_s.get(rule, 1.0) for rule, n in done.items()}
        ratio = (sum(taken_s.values()) + TRUSTED_S) / (sum(expected_s.values()) + TRUSTED_S)
        work_s, longest_s = 0.0, 0.0
        for rule, count in self.counts.items():
            known = taken_s.get(rule, 0.0) + ratio * TRUSTED_S
            job_s = self._expected_s[rule] * known / (expected_s.get(rule, 0.0) + TRUSTED_S)
            runs_s = [now_s - at_s for other, at_s in began if other == rule]
            left_s = [max(job_s - at_s, 0.0) for at_s in runs_s]
            waiting = max(count - done[rule] - len(left_s), 0)
            work_s += sum(left_s) + waiting * job_s
            longest_s = max([longest_s, *left_s, job_s if waiting else 0.0])
        return max(work_s / self._cores, longest_s)

    def share(self) -> float:
        """Return the part of the expected work that is done, from 0 to 1."""
        done = Counter(self.done)
        whole_s = sum(count * self._expected_s[rule] for rule, count in self.counts.items())
        done_s = sum(n * self._expected_s.get(rule, 0.0) for rule, n in done.items())
        return min(done_s / whole_s, 1.0) if whole_s else 1.0


class RunView:
    """Show a run on a console as its events come in.

    Args:
        console: A terminal, where the line stays, or none, where it comes once a minute.
        clock: Seconds, monotonic.
    """

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self._console, self._clock = console, clock
        self._said_s = self._begin_s = clock()
        self.left = TimeLeft({}, {}, 1)
        self._done, self._total = 0, 0
        self._live = Live(
            console=console,
            get_renderable=self._picture,
            refresh_per_second=2,
            redirect_stdout=sys.stdout.isatty(),
            redirect_stderr=False,
            transient=True,
        )

    def begin(self, left: TimeLeft) -> None:
        """Show the line, now that the jobs are known."""
        self._begin_s = self._clock()
        self.left, self._total = left, sum(left.counts.values())
        if self._console.is_terminal:
            self._live.start()
        else:
            self._say_line()

    def started(self, job: int, rule: str) -> None:
        """Note that a job of a rule began."""
        self.left.started(job, rule, self._clock())

    def finished(self, job: int) -> None:
        """Note that a job ended, well or not."""
        self.left.finished(job, self._clock())

    def progress(self, done: int, total: int) -> None:
        """Note how many jobs are done."""
        self._done, self._total = done, total
        if done == total:
            self.end()
        elif not self._live.is_started and self._clock() - self._said_s >= INTERVAL_S:
            self._say_line()

    def failed(self, job: str, logs: Iterable[Path]) -> None:
        """Print that a job failed, and what its logs end with."""
        self.say(f"error: {job} failed", "red")
        for log in logs:
            lines = log.read_text(errors="replace").splitlines() if log.is_file() else []
            self.say("\n".join([f"{log}:", *(f"    {line}" for line in lines[-LOG_LINES:])]))

    def say(self, text: str, style: str = "") -> None:
        """Print a message that stays."""
        self._console.print(Text(text, style), soft_wrap=True)

    def end(self) -> None:
        """Take the line away once a run is over or broken off, and print what was done."""
        if self._total:
            self._live.stop()
            done = f"{self._done} of {self._total} jobs"
            self.say(f"{done} done in {duration(self._clock() - self._begin_s)}")
            self._total = 0

    def line(self) -> str:
        """Return jobs done, rules at work, rate and time left."""
        now_s = self._clock()
        parts = [f"{self._done} of {self._total} jobs"]
        for rule in self.left.running[:RULES_SHOWN]:
            total = self.left.counts.get(rule, 1)
            done = f" {self.left.done[rule]} of {total}" if total > 1 else ""
            parts.append(f"{rule.replace('_', ' ')}{done}")
        if self._done and now_s > self._begin_s:
            parts.append(f"{number(60 * self._done / (now_s - self._begin_s))} jobs/min")
        return " · ".join([*parts, f"about {duration(self.left.seconds(now_s))} left"])

    def _say_line(self) -> None:
        self._said_s = self._clock()
        self.say(f"{time.strftime('%H:%M')}  {100 * self.left.share():.0f} %  {self.line()}")

    def _picture(self) -> Table:
        line = Table.grid(padding=(0, 1))
        bar = ProgressBar(1, self.left.share(), BAR_CELLS)
        line.add_row(bar, Text(self.line(), no_wrap=True))
        return line
