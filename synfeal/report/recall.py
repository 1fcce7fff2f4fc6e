"""The scores that localization papers print beside medians: means, recalls, reprojection error.

``recall.csv`` has every run of the design, its repetitions averaged; on paper stand the rows of
Table 4, where labels are true poses and there is one number for each score.
"""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
from pydantic import FiniteFloat

from synfeal.config import MODELS, Design, Run
from synfeal.evaluation.metrics import BOUNDS, MEANS, POSITION
from synfeal.evaluation.reprojection import DCRE_BOUNDS
from synfeal.frames import COUNT, MAYBE, TEXT, frame_of, write_frame
from synfeal.report.layouts import TITLES, scene_title
from synfeal.report.results import read_result, shaped
from synfeal.report.sheet import Sheet, sheet_of_texts, write_latex
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


def write_recall_table(design: Design, root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write one row per cell of any table, and the rows of Table 4 as LaTeX.

    Scores against the labels, under names that end in ``_true`` against the true poses, each with
    95 % limits; empty where a run failed.
    """
    table = recall_table(design, root)
    write_frame(out_csv, table)
    write_latex(out_tex, recall_sheet(design, table))


def recall_table(design: Design, root: Path) -> pd.DataFrame:
    """Scores of every cell, columns ``SCHEMA``; missing where a repetition has none."""
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
    """Scores of a run; those of DCRE are absent where its test frames show nothing."""
    needed = [column for column in COLUMNS if not column.startswith("dcre")]
    metrics = read_result(path, needed, REMEDY)
    found = {column: metrics[column] for column in COLUMNS if column in metrics}
    scores: dict[str, float | None] = shaped(path, found, dict[str, FiniteFloat | None], REMEDY)
    return scores


def recall_sheet(design: Design, table: pd.DataFrame) -> Sheet:
    """The rows of Table 4 as printed, a block for each; those of all tables where it has none."""
    rows = design.rows_of(PRINTED) or design.rows
    keys = pd.DataFrame(
        [(r.scene, r.size, r.label_id, r.init) for r in rows],
        columns=["scene", "size", "labels", "init"],
    )
    chosen = keys.merge(table, how="left", on=list(keys))
    records = [record for _, record in chosen.iterrows()]
    scores = {bound.title: bound.name for bound in BOUNDS}
    scores |= {"DCRE": DCRE[0], f"DCRE < {DCRE_BOUNDS[-1]:.0%}": DCRE[-1]}
    texts = pd.DataFrame(
        {
            "block": chosen.scene.map(scene_title) + ", " + chosen["size"],
            "Localizer": chosen.model.map(TITLES),
            "Mean error": [", ".join(shown(r, score) for score in MEANS.values()) for r in records],
            **{title: [shown(r, score) for r in records] for title, score in scores.items()},
        }
    )
    return sheet_of_texts(NAME, CAPTION, texts, (REMARK,))


def shown(record: pd.Series, score: str, end: str = "_true") -> str:
    """A score as printed; a dash where there is none."""
    value = float(record[f"{score}{end}"])
    if math.isnan(value):
        return "–"
    if score in MEANS.values():
        return f"{value:.2f} m" if score == MEANS[POSITION] else f"{value:.1f}°"
    return f"{100 * value:.1f} %"
