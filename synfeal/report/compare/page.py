"""A comparison as a person reads it: in the terminal and as Markdown."""

from __future__ import annotations

import math

from synfeal.report.compare.sheet import Row, Sheet
from synfeal.report.compare.stats import Difference
from synfeal.report.compare.summary import groups_of, remarks_of, summarise
from synfeal.report.compare.trees import Comparison, RunComparison
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


def text_of(comparison: Comparison) -> str:
    """Table, summary and remarks for the terminal, ending in a newline."""
    parts = [
        f"A = {comparison.names[0]}\nB = {comparison.names[1]}\n",
        LEGEND.replace("`", "") + "\n",
        runs_sheet(comparison).text(),
        summary_sheet(comparison).text(),
        groups_sheet(comparison).text(),
        "".join(f"- {remark}\n" for remark in remarks_of(comparison)),
    ]
    if comparison.changes:
        parts.append(changes_sheet(comparison).text())
    return "\n".join(parts)


def markdown_of(comparison: Comparison) -> str:
    """The same as a page: first what it comes to, then every run."""
    name_a, name_b = comparison.names
    parts = [
        f"# Comparison\n\nA = `{name_a}`  \nB = `{name_b}`\n",
        summary_sheet(comparison).markdown(),
        "".join(f"- {remark}\n" for remark in remarks_of(comparison)),
        "## Mean relative change\n",
        groups_sheet(comparison).markdown(),
        f"## Runs\n\n{LEGEND}\n",
        runs_sheet(comparison).markdown(),
        "![B−A of every run with its 95 % limits](compare.png)\n",
    ]
    if comparison.changes:
        parts += ["## What differs in provenance\n", changes_sheet(comparison).markdown()]
    return "\n".join(parts)


def runs_sheet(comparison: Comparison) -> Sheet:
    """One row per run and yardstick, in sections of one data set each."""
    errors = ("position A", "B", "B−A", "95 %", "", "orientation A", "B", "B−A", "95 %", "")
    sections: dict[str, list[Row]] = {}
    for run in comparison.runs:
        sections.setdefault("/".join(run.key[:-1]), []).extend(_run_rows(run))
    return Sheet(
        ("model", "against", *errors, "paths"),
        tuple((title, tuple(rows)) for title, rows in sections.items()),
        n_left=2,
    )


def summary_sheet(comparison: Comparison) -> Sheet:
    """One row per measure: verdicts, signs and the mean relative change."""
    rows = [
        (
            *(TITLES[s.measure], str(s.better), str(s.worse), str(s.unseen)),
            *(str(s.lower), str(s.higher)),
            *(f"{s.p_sign:.2g}", percent_text(s.percent)),
        )
        for s in summarise(comparison.runs)
    ]
    headings = ("runs", "better", "worse", "no difference seen", "lower", "higher", "sign test p")
    return Sheet((*headings, "mean change"), (("", tuple(rows)),))


def groups_sheet(comparison: Comparison) -> Sheet:
    """Mean relative changes by scene, label source and model."""
    sections: dict[str, list[Row]] = {}
    for group in groups_of(comparison.runs):
        changes = (percent_text(group.percent[m]) for m in MEASURES)
        row = (group.name, str(group.n_runs), *changes)
        sections.setdefault(f"mean change by {group.grouping}", []).append(row)
    return Sheet(
        ("", "runs", *SHORT), tuple((title, tuple(rows)) for title, rows in sections.items())
    )


def changes_sheet(comparison: Comparison) -> Sheet:
    """Keys of ``provenance.json`` that differ, the first of them."""
    changes = comparison.changes or ()
    rows = [(c.key, _value_text(c.a), _value_text(c.b)) for c in changes[:MOST_CHANGES]]
    if len(changes) > MOST_CHANGES:
        rows.append((f"… and {len(changes) - MOST_CHANGES} more", "", ""))
    return Sheet(("provenance.json", "A", "B"), (("", tuple(rows)),), n_left=3)


def percent_text(percent: float) -> str:
    """E.g. ``+3.1 %``."""
    if math.isinf(percent):
        return "+∞"
    return f"{percent:+.1f} %" if percent else "0"


def _run_rows(run: RunComparison) -> list[Row]:
    """Against labels and against true poses; a single row where these are the same numbers."""
    yardsticks = {"both": ""} if run.one_yardstick else {"labels": "", "true": "_true"}
    doubt = "?" if run.few_paths else ""
    return [
        (
            *(run.key.model if i == 0 else "", against),
            *_cells(run.differences[f"position_m{end}"], 3, doubt),
            *_cells(run.differences[f"orientation_deg{end}"], 2, doubt),
            str(min(run.n_paths)),
        )
        for i, (against, end) in enumerate(yardsticks.items())
    ]


def _cells(difference: Difference, digits: int, doubt: str) -> Row:
    spread = "" if difference.se_seeds is None else f" ± {difference.se_seeds:.{digits}f}"
    limits = f"[{_signed(difference.low, digits)}, {_signed(difference.high, digits)}]"
    seen = difference.verdict != "no difference seen"
    return (
        _error(difference.a, digits),
        _error(difference.b, digits),
        _signed(difference.value, digits) + spread,
        limits,
        difference.verdict + doubt if seen else UNSEEN,
    )


def _error(value: float, digits: int) -> str:
    return "failed" if math.isinf(value) else f"{value:.{digits}f}"


def _signed(value: float, digits: int) -> str:
    if math.isinf(value):
        return "+∞" if value > 0 else "-∞"
    return f"{value:+.{digits}f}" if value else "0"


def _value_text(value: str | None) -> str:
    if value is None:
        return "(none)"
    return value if len(value) <= WIDEST_VALUE else f"{value[: WIDEST_VALUE - 1]}…"
