"""What ``synfeal compare`` does and says: in the terminal, and as files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from synfeal.bootstrap import FEWEST_PATHS
from synfeal.files import atomic_path, refuse_foreign, write_text
from synfeal.frames import write_frame
from synfeal.report.compare.figure import comparison_figure
from synfeal.report.compare.runs import KEY
from synfeal.report.compare.summary import groups_of, remarks_of, summarise
from synfeal.report.compare.trees import Comparison, compare_trees, one_yardstick
from synfeal.report.sheet import MARKDOWN, PLAIN, text_table
from synfeal.report.stats import MEASURES

TITLES = {
    "position_m": "position, against labels (the paper's protocol)",
    "orientation_deg": "orientation, against labels (the paper's protocol)",
    "position_m_true": "position, against true poses",
    "orientation_deg_true": "orientation, against true poses",
}
SHORT = ("position, labels", "orientation, labels", "position, true", "orientation, true")
UNSEEN = "·"
LEGEND = (
    "Median errors, position in metres and orientation in degrees; B−A below zero is better. In"
    f" brackets its 95 % limits from a bootstrap over the paths of the test set; {UNSEEN} means"
    " that they hold zero: no difference seen. `labels` is the paper's protocol, `true` the"
    " simulator's exact poses, `both` where these are the same numbers."
)
# Keys of provenance that are printed, and letters of their values.
MOST_CHANGES, WIDEST_VALUE = 30, 40
Rows = list[Sequence[str]]


def text_of(comparison: Comparison, form: str = PLAIN) -> str:
    """Summary, remarks, changes by group, every run, and provenance: for the terminal or a page."""
    page = form == MARKDOWN
    figure = "![B−A of every run with its 95 % limits](compare.png)\n\n" if page else ""
    parts = {
        "Comparison": "A = `{}`  \nB = `{}`\n\n".format(*comparison.names)
        + text_table(summary_rows(comparison), 1, form)
        + "\n"
        + "".join(f"- {remark}\n" for remark in remarks_of(comparison)),
        "Mean relative change": text_table(group_rows(comparison), 2, form),
        "Runs": f"{LEGEND}\n\n{figure}{text_table(run_rows(comparison), 3, form)}",
    }
    if comparison.changes is not None and len(comparison.changes):
        rows = change_rows(comparison.changes)
        parts["What differs in provenance"] = text_table(rows, 3, form)
    text = "\n".join(f"{'## ' * page}{title}\n\n{part}" for title, part in parts.items())
    return text.removeprefix("#") if page else text.replace("`", "")


def run_rows(comparison: Comparison) -> Rows:
    """A row per run and yardstick, below its heading; a data set is named in its first row."""
    errors = ("position A", "B", "B−A", "95 %", "", "orientation A", "B", "B−A", "95 %", "")
    rows: Rows = [("data set", "model", "against", *errors, "paths")]
    shown = ""
    for key, run in comparison.table.groupby(list(KEY), sort=False):
        data_set = "/".join(map(str, key[:-1]))
        for row in _run_rows(run):
            rows.append(("" if data_set == shown else data_set, *row))
            shown = data_set
    return rows


def summary_rows(comparison: Comparison) -> Rows:
    """One row per measure: verdicts, signs and the mean relative change."""
    headings = ("runs", "better", "worse", "no difference seen", "lower", "higher", "sign test p")
    rows: Rows = [(*headings, "mean change")]
    for s in summarise(comparison.table).to_dict("records"):
        counts = (str(s[name]) for name in ("better", "worse", "unseen", "lower", "higher"))
        tests = f"{s['p_sign']:.2g}", percent_text(s["percent"])
        rows.append((TITLES[s["measure"]], *counts, *tests))
    return rows


def group_rows(comparison: Comparison) -> Rows:
    """Mean relative changes by scene, label source and model."""
    rows: Rows = [("by", "", "runs", *SHORT)]
    for group in groups_of(comparison.table).to_dict("records"):
        changes = (percent_text(group[measure]) for measure in MEASURES)
        rows.append((group["grouping"], group["name"], str(group["n_runs"]), *changes))
    return rows


def change_rows(changes: pd.DataFrame) -> Rows:
    """Keys of ``provenance.json`` that differ, the first of them."""
    shown = changes[["key", "a", "b"]].head(MOST_CHANGES).itertuples(index=False)
    rows: Rows = [("provenance.json", "A", "B")]
    rows += [(key, *map(_value_text, values)) for key, *values in shown]
    if len(changes) > MOST_CHANGES:
        rows.append((f"… and {len(changes) - MOST_CHANGES} more", "", ""))
    return rows


def percent_text(percent: float) -> str:
    """E.g. ``+3.1 %``."""
    if math.isinf(percent):
        return "+∞"
    return f"{percent:+.1f} %" if percent else "0"


def _run_rows(run: pd.DataFrame) -> list[tuple[str, ...]]:
    """Against labels and against true poses; a single row where these are the same numbers."""
    yardsticks = {"both": ""} if one_yardstick(run) else {"labels": "", "true": "_true"}
    first, by_measure = run.iloc[0], {row.measure: row for row in run.itertuples()}
    paths = min(first["n_paths_a"], first["n_paths_b"])
    doubt = "?" if paths < FEWEST_PATHS else ""
    return [
        (
            *("" if i else first["model"], against),
            *_cells(by_measure[f"position_m{end}"], 3, doubt),
            *_cells(by_measure[f"orientation_deg{end}"], 2, doubt),
            str(paths),
        )
        for i, (against, end) in enumerate(yardsticks.items())
    ]


def _cells(row: Any, digits: int, doubt: str) -> tuple[str, ...]:
    spread = "" if math.isnan(row.se_seeds) else f" ± {row.se_seeds:.{digits}f}"
    limits = f"[{_signed(row.low, digits)}, {_signed(row.high, digits)}]"
    seen = row.verdict != "no difference seen"
    difference = _signed(row.difference, digits) + spread
    verdict = row.verdict + doubt if seen else UNSEEN
    return _error(row.a, digits), _error(row.b, digits), difference, limits, verdict


def _error(value: float, digits: int) -> str:
    return "failed" if math.isinf(value) else f"{value:.{digits}f}"


def _signed(value: float, digits: int) -> str:
    if math.isinf(value):
        return "+∞" if value > 0 else "-∞"
    return f"{value:+.{digits}f}" if value else "0"


def _value_text(value: Any) -> str:
    if pd.isna(value):
        return "(none)"
    text = str(value)
    return text if len(text) <= WIDEST_VALUE else f"{text[: WIDEST_VALUE - 1]}…"


OUTPUTS = ("compare.csv", "compare.md", "compare.png")


def compare(root_a: Path, root_b: Path, out: Path | None) -> str:
    """Compare two result trees, before and after; the text to print.

    ``compare.csv``, ``compare.md`` and ``compare.png`` go into ``out``, made if need be; earlier
    files of these names are replaced.
    """
    if out is not None:
        refuse_foreign(out, OUTPUTS, "a comparison")
    comparison = compare_trees(root_a, root_b)
    if out is not None:
        with atomic_path(out / "compare.png") as temporary:
            comparison_figure(comparison).savefig(temporary, dpi=150)
        write_text(out / "compare.md", text_of(comparison, MARKDOWN))
        write_frame(out / "compare.csv", comparison.table)
    return text_of(comparison)
