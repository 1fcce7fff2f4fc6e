"""The table of recalls: of every run, both scores, of which a switch on the page shows one."""

from __future__ import annotations

from html import escape
from pathlib import Path

import pandas as pd

from synfeal.evaluation.metrics import BOUNDS, MEANS, ORIENTATION, POSITION
from synfeal.report import recall
from synfeal.report.html.markup import Column, plain_table, text_cell
from synfeal.report.layouts import TITLES, scene_title

SHOWN = {
    MEANS[POSITION]: "Mean, m",
    MEANS[ORIENTATION]: "Mean, °",
    **{bound.name: bound.title for bound in BOUNDS},
    recall.DCRE[0]: "DCRE",
    **{score: f"< {score.rsplit('_')[-1]}" for score in recall.DCRE[1:]},
}
CAPTION = f"<b>Recall.</b> {escape(recall.CAPTION)} {escape(recall.REMARK)} Small: 95 % limits."
ENDS = {"labels": "", "true": "_true"}


def recall_table(path: Path) -> str:
    """A row for every run of the design, its repetitions averaged."""
    columns = [Column(title) for title in ("Data set", "Labels", "Start", "Localizer")]
    columns += [Column(title, True) for title in SHOWN.values()]
    rows = [_row(record) for _, record in recall.read_recall_table(path).iterrows()]
    return plain_table(recall.NAME, CAPTION, columns, rows)


def _row(record: pd.Series) -> str:
    texts = (
        f"{scene_title(record['scene'])}, {record['size']}",
        *(record["labels"], record["init"], TITLES[record["model"]]),
    )
    return f"<tr>{''.join(map(text_cell, texts))}{''.join(_cell(record, s) for s in SHOWN)}</tr>"


def _cell(record: pd.Series, score: str) -> str:
    """One cell with both scores."""
    keys, shown = "", ""
    for style, end in ENDS.items():
        value = record[f"{score}{end}"]
        keys += f' data-{style}="{"" if pd.isna(value) else value}"'
        shown += f'<div class="{style}">{recall.shown(record, score, end)}'
        shown += f"<small>{_limits(record, score, end)}</small></div>"
    return f'<td class="number"{keys}>{shown}</td>'


def _limits(record: pd.Series, score: str, end: str) -> str:
    low, high = record[f"{score}{end}_low"], record[f"{score}{end}_high"]
    if pd.isna(low) or pd.isna(high):
        return ""
    factor = 1 if score in MEANS.values() else 100
    return f"{factor * low:.3g}–{factor * high:.3g}"
