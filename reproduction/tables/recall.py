"""The scores that localization papers print beside medians: means, recalls, reprojection error.

``recall.csv`` has every run of the design, its repetitions averaged; on paper stand those of
Table 4, whose labels are true poses: there is one number for each score.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from pydantic import FiniteFloat

from baselines.config.learning import MODELS
from baselines.labels.methods import SIMULATOR
from reproduction.design.experiments import Design, Run
from reproduction.runs.results import read_result, shaped
from reproduction.statistics.limits import REMEDY
from reproduction.tables.columns import Column, SideLayout
from reproduction.tables.layouts import TITLES, data_set_titles, label_title
from reproduction.tables.side import SideTable, Source, Table
from synfeal.evaluation.metrics import BOUNDS, MEANS, ORIENTATION, POSITION
from synfeal.evaluation.reprojection import DCRE_BOUNDS
from synfeal.records.tables import COUNT, MAYBE, TEXT, frame_of

NAME = "recall"
KEYS = ["scene", "size", "labels", "init", "model"]
DCRE = ("dcre", *(f"dcre_below_{bound:g}" for bound in DCRE_BOUNDS))
SCORES = (*MEANS.values(), *(bound.name for bound in BOUNDS), *DCRE)
COLUMNS = [
    f"{score}{end}{limit}"
    for score in SCORES
    for end in ("", "_true")
    for limit in ("", "_low", "_high")
]
SCHEMA = {**dict.fromkeys(KEYS, TEXT), "n_seeds": COUNT, **dict.fromkeys(COLUMNS, MAYBE)}
CAPTION = (
    "Share of the test frames with both errors below a bound, and dense correspondence reprojection"
    " error (DCRE, share of the image's diagonal); not in the paper."
)
REMARK = (
    "5 cm, 5° is 7-Scenes' bound, 10 cm, 5° ACE's; 25 cm, 2°, 50 cm, 5° and 5 m, 10° are the"
    " visual-localization benchmark's; 50 cm, 15° suits regression at this scale. DCRE: median over"
    " the frames, and the share of frames below 15 %."
)
SHOWN = (
    Column("Data set", "data_set"),
    Column("Labels", "labels", on_paper=False),
    Column("Start", "init", on_paper=False),
    Column("Localizer", "model"),
    Column("Mean, m", MEANS[POSITION], "{:.2f} m", scored=True),
    Column("Mean, °", MEANS[ORIENTATION], "{:.1f}°", scored=True),
    *(Column(bound.title, bound.name, "{:.1f} %", 100, scored=True) for bound in BOUNDS),
    Column("DCRE", DCRE[0], "{:.1f} %", 100, scored=True),
    *(
        Column(f"DCRE < {bound:.0%}", f"dcre_below_{bound:g}", "{:.1f} %", 100, scored=True)
        for bound in DCRE_BOUNDS
    ),
)


def recall_table(design: Design, root: Path) -> pd.DataFrame:
    """Tabulate scores of every cell, columns ``SCHEMA``; missing where a repetition has none."""
    runs = sorted(design.runs, key=lambda run: (*_key(run)[:-1], MODELS.index(run.model)))
    records = [
        dict(zip(KEYS, _key(run), strict=True))
        | _read(root / "runs" / run.directory / "metrics.json")
        for run in runs
    ]
    cells = frame_of(records, SCHEMA | {"n_seeds": MAYBE}).groupby(KEYS, sort=False)
    means = cells[COLUMNS].mean(skipna=False)
    return means.assign(n_seeds=cells.size()).reset_index()[list(SCHEMA)]


def _key(run: Run) -> tuple[str, ...]:
    return tuple(getattr(run, key) for key in KEYS)


def _read(path: Path) -> dict[str, float | None]:
    """Read scores of a run; those of DCRE are absent where its test frames show nothing."""
    needed = [column for column in COLUMNS if not column.startswith("dcre")]
    metrics = read_result(path, needed, REMEDY)
    found = {column: metrics[column] for column in COLUMNS if column in metrics}
    scores: dict[str, float | None] = shaped(path, found, dict[str, FiniteFloat | None], REMEDY)
    return scores


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out a row for every run; on paper those whose labels are true, if there are any."""
    true = (table.labels == SIMULATOR) & (table.init == "pretrained")
    rows = table.assign(
        data_set=data_set_titles(table),
        labels=table.labels.map(label_title),
        model=table.model.map(TITLES),
        on_paper=true | (not true.any()),
    )
    return SideLayout(NAME, CAPTION, SHOWN, rows, REMARK, block="data_set")


@SideTable(
    name="recall",
    title="Recall",
    rank=30,
    needs=("runs/{run}/metrics.json",),
    in_document=True,
    in_summary=True,
)
class RecallTable(Table):
    """Means, recalls and reprojection errors of every cell of any table."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Read the scores of all runs."""
        return recall_table(source.design, source.root)
