"""The table of scores that fills while a run is under way."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

from synfeal.config import MODELS, Run
from synfeal.report.layouts import TITLES
from synfeal.report.stats import read_metrics

Row = tuple[str, str, str, str]  # scene, size, labels, init
HEADING = ("m, degrees", *TITLES.values())
MISSING = "…"


class FirstScores:
    """Median errors against the true poses, one line per data set, one column per localizer.

    Args:
        root: results of the profile.
        runs: training runs of the design.
    """

    def __init__(self, root: Path, runs: Sequence[Run]) -> None:
        self._run_of = {root / "runs" / run.directory / "metrics.json": run for run in runs}
        self._rows: dict[Row, list[Run]] = {}
        for run in runs:
            self._rows.setdefault(_row(run), []).append(run)
        self._scores: dict[Run, tuple[float, float] | None] = {}

    def add(self, metrics: Path) -> Row | None:
        """Read the scores of a run; its row, or None where the file is of no run of the design."""
        run = self._run_of.get(metrics)
        if run is None:
            return None
        scores = read_metrics(metrics)
        position_m, deg = scores["position_m_true"], scores["orientation_deg_true"]
        self._scores[run] = None if position_m is None or deg is None else (position_m, deg)
        return _row(run)

    def complete(self, row: Row) -> bool:
        """Whether every run of a row has its scores."""
        return all(run in self._scores for run in self._rows[row])

    def cells(self, row: Row) -> list[str]:
        """Label and cells of a row; of repetitions the mean of those there are."""
        return [label(row), *(self._cell(row, model) for model in MODELS)]

    def _cell(self, row: Row, model: str) -> str:
        runs = [run for run in self._rows[row] if run.model == model]
        known = [self._scores[run] for run in runs if run in self._scores]
        finished = [score for score in known if score is not None]
        if not finished:
            return "failed" if known else MISSING
        position_m, orientation_deg = map(fmean, zip(*finished, strict=True))
        return f"{position_m:.2f} {orientation_deg:.3g}°"


def label(row: Row) -> str:
    """A data set in few letters: what is usual goes without saying."""
    scene, size, labels, init = row
    rest = [part for part in (labels, init) if part not in ("synfeal", "pretrained")]
    return " ".join([scene, size, *rest]).replace("noise-", "")


def _row(run: Run) -> Row:
    return run.scene, run.size, run.labels, run.init
