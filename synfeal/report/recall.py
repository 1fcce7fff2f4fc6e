"""The scores that localization papers print beside medians: means, recalls, reprojection error.

``recall.csv`` has every run of the design, its repetitions averaged; on paper stand the rows of
Table 4, where labels are true poses and there is one number for each score.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from statistics import fmean

import pandas as pd
from pydantic import FiniteFloat, TypeAdapter

from synfeal.config import MODELS, Design, Run
from synfeal.evaluation.metrics import BOUNDS, MEANS, POSITION
from synfeal.evaluation.reprojection import DCRE_BOUNDS
from synfeal.files import atomic_path
from synfeal.report.grid import Entry, Grid, Group, Line, Value
from synfeal.report.latex import write_latex
from synfeal.report.layouts import TITLES, scene_title
from synfeal.report.results import check_result, read_result, read_table
from synfeal.report.stats import REMEDY

NAME, PRINTED = "recall", "table4_size"
KEYS = ["scene", "size", "labels", "init", "model"]
DCRE = ("dcre", *(f"dcre_below_{bound:g}" for bound in DCRE_BOUNDS))
SCORES = (*MEANS.values(), *(bound.name for bound in BOUNDS), *DCRE)
COLUMNS = [
    f"{score}{end}{limit}"
    for score in SCORES
    for end in ("", "_true")
    for limit in ("", "_low", "_high")
]
_SCORES = TypeAdapter(dict[str, FiniteFloat | None])
CAPTION = (
    "Share of the test frames with both errors below a bound, and dense correspondence reprojection"
    " error (DCRE, share of the image's diagonal); not in the paper."
)
REMARK = (
    "5 cm, 5° is 7-Scenes' bound, 10 cm, 5° ACE's; 25 cm, 2°, 50 cm, 5° and 5 m, 10° are the"
    " visual-localization benchmark's; 50 cm, 15° suits regression at this scale. DCRE: median over"
    " the frames, and the share of frames below 15 %."
)


def write_recall_table(design: Design, root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write one row per cell of any table, and the rows of Table 4 as LaTeX.

    Args:
        design: of the profile.
        root: results directory of the profile, where ``runs`` is.
        out_csv: scores against the labels, under names that end in ``_true`` against the true
            poses, each with 95 % limits; empty where a run failed.
        out_tex: a table environment.

    Raises:
        InputError: a run's scores are missing or unreadable.
    """
    table = recall_table(design, root)
    with atomic_path(out_csv) as temporary:
        table.to_csv(temporary, index=False, float_format="%.6g", lineterminator="\n")
    write_latex(out_tex, recall_grid(design, table))


def recall_table(design: Design, root: Path) -> pd.DataFrame:
    """Scores of every cell, columns ``KEYS``, ``n_seeds`` and ``COLUMNS``."""
    runs = sorted(design.runs, key=lambda run: (*_key(run)[:-1], MODELS.index(run.model)))
    cells = groupby(runs, _key)
    rows = [dict(zip(KEYS, key, strict=True)) | _cell(list(same), root) for key, same in cells]
    return pd.DataFrame(rows, columns=[*KEYS, "n_seeds", *COLUMNS])


def _key(run: Run) -> tuple[str, ...]:
    return tuple(getattr(run, key) for key in KEYS)


def _cell(runs: Sequence[Run], root: Path) -> dict[str, float | None]:
    """Mean of each score over the repetitions; None where one of them has none."""
    every = [_read(root / "runs" / run.directory / "metrics.json") for run in runs]
    found: dict[str, float | None] = {"n_seeds": len(runs)}
    for column in COLUMNS:
        values = [metrics.get(column) for metrics in every]
        known = [value for value in values if value is not None]
        found[column] = fmean(known) if len(known) == len(values) else None
    return found


def _read(path: Path) -> dict[str, float | None]:
    """Scores of a run; those of DCRE are absent where its test frames show nothing."""
    needed = [column for column in COLUMNS if not column.startswith("dcre")]
    metrics = read_result(path, needed, REMEDY)
    scores = {column: metrics[column] for column in COLUMNS if column in metrics}
    check_result(path, scores, _SCORES, REMEDY)
    return scores


def read_recall_table(path: Path) -> pd.DataFrame:
    """What :func:`write_recall_table` wrote.

    Raises:
        InputError: it cannot be read, or is another table.
    """
    rows = read_table(path, (*KEYS, "n_seeds", *COLUMNS), optional=COLUMNS)
    table = pd.DataFrame(rows, columns=[*KEYS, "n_seeds", *COLUMNS])
    return table.astype(dict.fromkeys(COLUMNS, float)) if len(rows) else table


def recall_grid(design: Design, table: pd.DataFrame) -> Grid:
    """The rows of Table 4 as printed, a block for each; those of all tables where it has none."""
    headings = [
        *("Localizer", "Mean error", *(bound.title for bound in BOUNDS)),
        *("DCRE", f"DCRE < {DCRE_BOUNDS[-1]:.0%}"),
    ]
    groups = []
    for row in design.rows_of(PRINTED) or design.rows:
        keys = {"scene": row.scene, "size": row.size, "labels": row.label_id, "init": row.init}
        chosen = table[(table[list(keys)] == pd.Series(keys)).all(axis=1)]
        lines = [(_line(record),) for _, record in chosen.iterrows()]
        groups.append(Group(f"{scene_title(row.scene)}, {row.size}", tuple(lines)))
    return Grid(NAME, CAPTION, tuple(headings), tuple(groups), (REMARK,))


def _line(record: pd.Series) -> Line:
    """A localizer's scores against the true poses."""
    mean = ", ".join(shown(record, score) for score in MEANS.values())
    scores = (*(bound.name for bound in BOUNDS), DCRE[0], DCRE[-1])
    entries = tuple(Entry((Value(shown(record, score)),)) for score in scores)
    return Line("truth", TITLES[record["model"]], mean, entries)


def shown(record: pd.Series, score: str, end: str = "_true") -> str:
    """A score as printed; a dash where there is none."""
    value = float(record[f"{score}{end}"])
    if math.isnan(value):
        return "–"
    if score in MEANS.values():
        return f"{value:.2f} m" if score == MEANS[POSITION] else f"{value:.1f}°"
    return f"{100 * value:.1f} %"
