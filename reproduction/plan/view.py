"""Display of a run on a terminal: a growing table of scores above one status line.

Where there is no terminal, rows of the table are printed once they are whole, and the line at
intervals.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import fmean

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from baselines.config.learning import MODELS
from reproduction.design.experiments import Run
from reproduction.plan.progress import RunPlan, TimeLeft
from reproduction.plan.text import duration
from reproduction.statistics.limits import read_metrics
from reproduction.tables.layouts import TITLES
from synfeal.errors import InputError

HEADING = ("m, degrees", *TITLES.values())
MISSING = "…"


class FirstScores:
    """Median errors against the true poses, one line per data set, one column per localizer."""

    def __init__(self, root: Path, runs: Sequence[Run]) -> None:
        self._run_of = {root / "runs" / run.directory / "metrics.json": run for run in runs}
        # By row and run; None of a run without scores, nothing of one that is still to come.
        self._scores: dict[str, dict[Run, tuple[float, float] | None]] = {}
        self._expected = Counter(map(label, {*runs}))

    def add(self, metrics: Path) -> str | None:
        """Read the scores of a run; its row, or None where the file is of no run of the design."""
        run = self._run_of.get(metrics)
        if run is None:
            return None
        scores = read_metrics(metrics)
        position_m, deg = scores["position_m_true"], scores["orientation_deg_true"]
        found = None if position_m is None or deg is None else (position_m, deg)
        self._scores.setdefault(label(run), {})[run] = found
        return label(run)

    def complete(self, row: str) -> bool:
        """Tell whether every run of a row has its scores."""
        return len(self._scores.get(row, {})) == self._expected[row]

    def cells(self, row: str) -> list[str]:
        """Label and cells of a row; of repetitions the mean of those there are."""
        texts = [row]
        for model in MODELS:
            known = [s for run, s in self._scores.get(row, {}).items() if run.model == model]
            finished = [score for score in known if score is not None]
            text = "failed" if known else MISSING
            if finished:
                text = "{:.2f} {:.3g}°".format(*map(fmean, zip(*finished, strict=True)))
            texts.append(text)
        return texts


def label(run: Run) -> str:
    """Name the data set of a run in few letters; what is usual is left out."""
    rest = [part for part in (run.labels, run.init) if part not in ("synfeal", "pretrained")]
    return " ".join([run.scene, run.size, *rest]).replace("noise-", "")


INTERVAL_S = 60.0
BAR_CELLS = 20
LOG_LINES = 20
STAGES_SHOWN = 2
# Characters of a row: scene and labels, and a score; titles of localizers take up to 14.
LABEL, NARROW_CELL, WIDE_CELL = 25, 10, 14
LINES_BELOW = 4  # of a small terminal: heading, line, and some room


class RunView:
    """Shows a run on a console as its events come in; ``clock`` gives seconds, monotonic."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self._console = console
        self._clock = clock
        self._said_s = self._begin_s = clock()
        self._time_left = TimeLeft({}, 1)
        self._scores = FirstScores(Path(), ())
        self._open_rows: list[str] = []
        self._done, self._total = 0, 0
        self._headed = False
        self._live = Live(
            console=console,
            get_renderable=self._picture,
            refresh_per_second=2,
            redirect_stdout=sys.stdout.isatty(),
            redirect_stderr=False,
            transient=True,
        )

    def begin(self, plan: RunPlan) -> None:
        """Show the jobs once they are known."""
        self._begin_s = self._clock()
        self._time_left = TimeLeft(plan.expected_s, plan.cores)
        self._scores = FirstScores(plan.root, plan.runs)
        self._total = len(plan.expected_s)
        for run in plan.runs:
            metrics = plan.root / "runs" / run.directory / "metrics.json"
            scoring = {f"{rule}/{run.directory}" for rule in ("train", "score")}
            if scoring.isdisjoint(plan.expected_s) and metrics.exists():
                self.scored(metrics)
        if self._console.is_terminal:
            self._live.start()
        else:
            self._say_line()

    def started(self, job: str) -> None:
        """Note that a job ``stage/name`` began."""
        self._time_left.started(job, self._clock())

    def finished(self, job: str) -> None:
        """Note that a job ended, successfully or not."""
        self._time_left.finished(job, self._clock())

    def scored(self, metrics: Path) -> None:
        """Show a new ``metrics.json``; the run complains of one that no table can show."""
        try:
            row = self._scores.add(metrics)
        except InputError:
            return
        if row is None:
            return
        if self._scores.complete(row):
            self._open_rows = [other for other in self._open_rows if other != row]
            table = _columns(self._console.width)
            if not self._headed:
                table.add_row(*HEADING, style="bold")
                self._headed = True
            table.add_row(*self._scores.cells(row))
            self._console.print(table)
        elif row not in self._open_rows:
            self._open_rows.append(row)

    def progress(self, done: int, total: int) -> None:
        """Note how many jobs are done."""
        self._done, self._total = done, total
        if done == total:
            self.end()
        elif not self._live.is_started and self._clock() - self._said_s >= INTERVAL_S:
            self._say_line()

    def failed(self, job: str, logs: Iterable[Path]) -> None:
        """Show that a job failed, and what its log ends with."""
        self.say(f"error: {job} failed", "red")
        for log in logs:
            lines = log.read_text(errors="replace").splitlines() if log.is_file() else []
            self.say("\n".join([f"{log}:", *(f"    {line}" for line in lines[-LOG_LINES:])]))

    def say(self, text: str, style: str | None = None) -> None:
        """Print a message that stays."""
        self._console.print(Text(text, style or ""), soft_wrap=True)

    def end(self) -> None:
        """End the display when the run is over or broken off, and say what was done."""
        if self._total:
            self._live.stop()
            done = f"{self._done} of {self._total} jobs"
            self.say(f"{done} done in {duration(self._clock() - self._begin_s)}")
            self._total = 0

    def line(self) -> str:
        """Format jobs done, stages at work, time left."""
        now_s = self._clock()
        parts = [f"{self._done} of {self._total} jobs"]
        stages = dict.fromkeys(job.partition("/")[0] for job in self._time_left.running)
        for stage in list(stages)[:STAGES_SHOWN]:
            done, total = self._time_left.count(stage)
            parts.append(f"{stage.replace('_', ' ')} {done} of {total}" if total > 1 else stage)
        left_s = self._time_left.seconds(now_s)
        parts.append(f"about {duration(left_s)} left")
        return " · ".join(parts)

    def _say_line(self) -> None:
        self._said_s = self._clock()
        share = 100 * self._time_left.share()
        self.say(f"{time.strftime('%H:%M')}  {share:.0f} %  {self.line()}")

    def _picture(self) -> Group:
        """Draw the rows that are being filled, as many as there is room for, and the line."""
        room = max(self._console.size.height - LINES_BELOW, 0)
        rows = self._open_rows[-room:] if room else []
        table = _columns(self._console.width)
        for row in rows:
            table.add_row(*self._scores.cells(row), style="dim")
        line = Table.grid(padding=(0, 1))
        bar = ProgressBar(1, self._time_left.share(), BAR_CELLS)
        line.add_row(bar, Text(self.line(), no_wrap=True))
        return Group(table, line)


def _columns(width: int) -> Table:
    """Build a grid whose columns keep their widths, for rows come one by one."""
    cells = len(HEADING) - 1
    cell = WIDE_CELL if width >= LABEL + cells * (WIDE_CELL + 1) else NARROW_CELL
    table = Table.grid(padding=(0, 1))
    table.add_column(width=LABEL, no_wrap=True)
    for _ in range(cells):
        table.add_column(width=cell, justify="right", no_wrap=True)
    return table
