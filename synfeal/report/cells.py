"""The cells of tables 2 to 5: what each run scored, beside what the paper published."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from synfeal.config import MODELS, Experiment, Run
from synfeal.report.published import PublishedCell, key_of, published_cells
from synfeal.report.stats import MEASURES, CellScores, combine, percent_change, read_metrics

FROM_SCRATCH = "table5_from_scratch"


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


def table_runs(table: str, rows: Sequence[Experiment], repetitions: int) -> list[Run]:
    """Every run a table reads; Table 5 also reads its rows' counterparts with transfer learning."""
    needed = [*rows, *map(pretrained, rows)] if table == FROM_SCRATCH else rows
    return sorted({run for row in needed for m in MODELS for run in _runs(row, m, repetitions)})


def pretrained(row: Experiment) -> Experiment:
    """The same data set, trained with transfer learning."""
    return row.model_copy(update={"init": "pretrained"})


def read_cells(
    table: str, rows: Sequence[Experiment], repetitions: int, root: Path
) -> tuple[Cell, ...]:
    """Read the cells of one table, row by row, five localizers each.

    Args:
        table: one of tables 2 to 5.
        rows: its rows, of any number; what is not asked for is not in the table.
        repetitions: seeds per cell.
        root: results directory of the profile.

    Raises:
        InputError: a run's scores are missing or unreadable.
    """
    published = published_cells(table)
    cells = []
    for row in rows:
        for model in MODELS:
            own = _scores(row, model, repetitions, root)
            change: dict[str, float | None] = {}
            if table == FROM_SCRATCH:
                change = _change(own, _scores(pretrained(row), model, repetitions, root))
            cells.append(Cell(row, model, own, published.get(key_of(row, model)), change))
    return tuple(cells)


def _runs(row: Experiment, model: str, repetitions: int) -> list[Run]:
    dataset = (row.scene, row.size, row.label_id, row.init)
    return [Run(*dataset, model, repetition) for repetition in range(repetitions)]


def _scores(row: Experiment, model: str, repetitions: int, root: Path) -> CellScores:
    runs = _runs(row, model, repetitions)
    return combine([read_metrics(root / "runs" / run.directory / "metrics.json") for run in runs])


def _change(new: CellScores, old: CellScores) -> dict[str, float | None]:
    return {m: percent_change(new.scores[m].value, old.scores[m].value) for m in MEASURES}
