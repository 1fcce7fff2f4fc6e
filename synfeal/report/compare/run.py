"""What ``synfeal compare`` does and says: in the terminal, as Markdown, as files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd

from synfeal.bootstrap import FEWEST_PATHS
from synfeal.dataset.directories import refuse_foreign
from synfeal.files import atomic_path
from synfeal.frames import write_frame
from synfeal.report.aligned import aligned, aligned_sections, markdown
from synfeal.report.compare.figure import comparison_figure
from synfeal.report.compare.runs import KEY
from synfeal.report.compare.summary import groups_of, remarks_of, summarise
from synfeal.report.compare.trees import Comparison, compare_trees, one_yardstick
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
Sheet = tuple[tuple[str, ...], dict[str, list[tuple[str, ...]]], int]  # headings, sections, n_left


def text_of(comparison: Comparison) -> str:
    """Table, summary and remarks for the terminal, ending in a newline."""
    parts = [
        f"A = {comparison.names[0]}\nB = {comparison.names[1]}\n",
        LEGEND.replace("`", "") + "\n",
        aligned_sections(*runs_sheet(comparison)),
        _plain(summary_sheet(comparison)),
        aligned_sections(*groups_sheet(comparison)),
        "".join(f"- {remark}\n" for remark in remarks_of(comparison)),
    ]
    if comparison.changes is not None and len(comparison.changes):
        parts.append(_plain(changes_sheet(comparison.changes)))
    return "\n".join(parts)


def markdown_of(comparison: Comparison) -> str:
    """The same as a page: first what it comes to, then every run."""
    name_a, name_b = comparison.names
    parts = [
        f"# Comparison\n\nA = `{name_a}`  \nB = `{name_b}`\n",
        markdown(*summary_sheet(comparison)),
        "".join(f"- {remark}\n" for remark in remarks_of(comparison)),
        "## Mean relative change\n",
        markdown(*groups_sheet(comparison)),
        f"## Runs\n\n{LEGEND}\n",
        markdown(*runs_sheet(comparison)),
        "![B−A of every run with its 95 % limits](compare.png)\n",
    ]
    if comparison.changes is not None and len(comparison.changes):
        parts += ["## What differs in provenance\n", markdown(*changes_sheet(comparison.changes))]
    return "\n".join(parts)


def _plain(sheet: Sheet) -> str:
    """A table of one section for the terminal."""
    headings, sections, n_left = sheet
    return aligned([headings, *sections[""]], range(n_left))


def runs_sheet(comparison: Comparison) -> Sheet:
    """One row per run and yardstick, in sections of one data set each."""
    errors = ("position A", "B", "B−A", "95 %", "", "orientation A", "B", "B−A", "95 %", "")
    sections: dict[str, list[tuple[str, ...]]] = {}
    for key, run in comparison.table.groupby(list(KEY), sort=False):
        sections.setdefault("/".join(map(str, key[:-1])), []).extend(_run_rows(run))
    return ("model", "against", *errors, "paths"), sections, 2


def summary_sheet(comparison: Comparison) -> Sheet:
    """One row per measure: verdicts, signs and the mean relative change."""
    rows = []
    for s in summarise(comparison.table).to_dict("records"):
        counts = (str(s[name]) for name in ("better", "worse", "unseen", "lower", "higher"))
        tests = f"{s['p_sign']:.2g}", percent_text(s["percent"])
        rows.append((TITLES[s["measure"]], *counts, *tests))
    headings = ("runs", "better", "worse", "no difference seen", "lower", "higher", "sign test p")
    return (*headings, "mean change"), {"": rows}, 1


def groups_sheet(comparison: Comparison) -> Sheet:
    """Mean relative changes by scene, label source and model."""
    groups = groups_of(comparison.table)
    sections: dict[str, list[tuple[str, ...]]] = {}
    for group in groups.to_dict("records"):
        changes = (percent_text(group[measure]) for measure in MEASURES)
        section = sections.setdefault(f"mean change by {group['grouping']}", [])
        section.append((group["name"], str(group["n_runs"]), *changes))
    return ("", "runs", *SHORT), sections, 1


def changes_sheet(changes: pd.DataFrame) -> Sheet:
    """Keys of ``provenance.json`` that differ, the first of them."""
    shown = changes[["key", "a", "b"]].head(MOST_CHANGES).itertuples(index=False)
    rows = [(key, *map(_value_text, values)) for key, *values in shown]
    if len(changes) > MOST_CHANGES:
        rows.append((f"… and {len(changes) - MOST_CHANGES} more", "", ""))
    return ("provenance.json", "A", "B"), {"": rows}, 3


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
            *(first["model"] if i == 0 else "", against),
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
        _write(comparison, out)
    return text_of(comparison)


def _write(comparison: Comparison, out: Path) -> None:
    figure = comparison_figure(comparison)
    with atomic_path(out / "compare.png") as temporary:
        figure.savefig(temporary, dpi=150)
    with atomic_path(out / "compare.md") as temporary:
        temporary.write_text(markdown_of(comparison), encoding="utf-8")
    write_frame(out / "compare.csv", comparison.table)
