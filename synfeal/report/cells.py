"""The cells of tables 2 to 5: what each run scored, beside what the paper published."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from synfeal.config import MODELS, Design, Experiment, Run
from synfeal.config.experiments import FROM_SCRATCH
from synfeal.report.published import PublishedCell, key_of, published_cells
from synfeal.report.stats import MEASURES, CellScores, combine, percent_change, read_metrics


@dataclass(frozen=True)
class Cell:
    """One cell of tables 2 to 5.

    Attributes:
        row: the table row.
        model: the localizer.
        own: regenerated scores.
        published: the paper's cell of the same design, if there is one.
        change_percent: Table 5: by measure, the change against the run with transfer learning; None
            where either run failed. Empty in the other tables.
    """

    row: Experiment
    model: str
    own: CellScores
    published: PublishedCell | None
    change_percent: dict[str, float | None]


def read_cells(table: str, design: Design, root: Path) -> tuple[Cell, ...]:
    """Read the cells of one table, row by row, five localizers each.

    Args:
        table: one of tables 2 to 6.
        design: of the profile; rows it leaves out are not in the table.
        root: results directory of the profile.

    Raises:
        InputError: a run's scores are missing or unreadable.
    """
    published = published_cells(table)
    cells = []
    for row in design.rows_of(table):
        for model in MODELS:
            own = _scores(design.runs_of(row, model), root)
            change: dict[str, float | None] = {}
            if table == FROM_SCRATCH:
                change = _change(own, _scores(design.runs_of(row.pretrained, model), root))
            cells.append(Cell(row, model, own, published.get(key_of(row, model)), change))
    return tuple(cells)


def _scores(runs: Sequence[Run], root: Path) -> CellScores:
    return combine([read_metrics(root / "runs" / run.directory / "metrics.json") for run in runs])


def _change(new: CellScores, old: CellScores) -> dict[str, float | None]:
    return {m: percent_change(new.scores[m].value, old.scores[m].value) for m in MEASURES}
