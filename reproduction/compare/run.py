"""The command ``synfeal compare``: output in the terminal, and files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.compare.figure import comparison_figure
from reproduction.compare.trees import (
    KEY,
    VERDICTS,
    Comparison,
    compare_trees,
    groups_of,
    one_yardstick,
    summary_of,
)
from reproduction.statistics.limits import MEASURES
from reproduction.tables.sheet import MARKDOWN, PLAIN, text_table
from synfeal.evaluation.bootstrap import CONFIDENCE, FEWEST_PATHS
from synfeal.records.files import atomic_path, refuse_foreign, write_text
from synfeal.records.tables import rows_of, write_frame

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
    f" brackets its 95 % limits over test paths and training runs; {UNSEEN} means that they hold"
    " zero: no difference seen. `labels` is the paper's protocol, `true` the"
    " simulator's exact poses, `both` where these are the same numbers."
)
# Keys of provenance that are printed, and letters of their values.
MOST_CHANGES, WIDEST_VALUE = 30, 40
Rows = list[Sequence[str]]
OUTPUTS = ("compare.csv", "compare.md", "compare.png")
ONE_SEED = (
    "Of these, how far another training would move an error is taken from published runs of the"
    " same localizer. Compare several seeds (training.repetitions) to know it of your own."
)


def compare(root_a: Path, root_b: Path, out: Path | None) -> str:
    """Compare two result trees, before and after.

    Args:
        root_a: Results before.
        root_b: Results after.
        out: Folder for ``compare.csv``, ``compare.md`` and ``compare.png``, made if need be;
            earlier files of these names are replaced. None writes none.

    Returns:
        The comparison as text for a terminal.

    Raises:
        InputError: a tree cannot be read, or ``out`` holds something else than a comparison.
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


def text_of(comparison: Comparison, form: str = PLAIN) -> str:
    """Format summary, remarks, changes by group, every run and provenance as text."""
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


def summary_rows(comparison: Comparison) -> Rows:
    """Tabulate verdicts, signs and the mean relative change, one row per measure."""
    found = summary_of(comparison.table)
    found["measure"] = found["measure"].map(TITLES)
    found["p_sign"] = found["p_sign"].map("{:.2g}".format)
    found["percent"] = found["percent"].map(_signed)
    signs = ("lower", "higher", "sign test p", "mean change")
    return [("runs", *VERDICTS.values(), *signs), *_texts(found)]


def group_rows(comparison: Comparison) -> Rows:
    """Tabulate mean relative changes by scene, label source and model."""
    found = groups_of(comparison.table)
    for measure in MEASURES:
        found[measure] = found[measure].map(_signed)
    return [("by", "", "runs", *SHORT), *_texts(found)]


def _texts(table: pd.DataFrame) -> Rows:
    return list(table.astype(str).itertuples(index=False, name=None))


def remarks_of(comparison: Comparison) -> list[str]:
    """Say how the runs were matched and how far the numbers carry."""
    runs = comparison.runs
    only_a, only_b = comparison.only
    by_chance = (1 - CONFIDENCE) * len(runs)
    few = (runs[["n_paths_a", "n_paths_b"]].min(axis="columns") < FEWEST_PATHS).sum()
    single = (runs[["n_seeds_a", "n_seeds_b"]].min(axis="columns") < 2).sum()
    failed_a, failed_b = runs["failed_a"].sum(), runs["failed_b"].sum()
    differ, unknown = ((runs["test_labels"] == found).sum() for found in ("differ", "unknown"))
    changes = comparison.changes
    found = {
        f"Runs in both trees: {len(runs)}; only in A: {only_a}; only in B: {only_b}.": True,
        _pairing(runs): True,
        f"Runs with other test labels in B: {differ}; against the labels, their yardstick changed"
        " too.": differ,
        f"Runs whose test labels a tree lacks (labels/…/test.csv): {unknown}; whether their"
        " yardstick changed is unknown.": unknown,
        f"Runs with fewer than {FEWEST_PATHS} test paths: {few}; their intervals are too narrow,"
        " hence the question marks.": few,
        f"Runs with one seed in a tree: {single}. {ONE_SEED}": single,
        f"Failed predictions: {failed_a} in A, {failed_b} in B; each counts as an infinite"
        " error.": failed_a + failed_b,
        f"Were both trees equally good, about {by_chance:.1f} of the {len(runs)} intervals of a"
        " measure would still miss zero by chance. Runs share test frames, so the sign test is a"
        " guide, not a proof.": True,
        f"Keys of provenance.json that differ: {0 if changes is None else len(changes)}.": (
            changes is not None
        ),
    }
    return [sentence for sentence, applies in found.items() if applies]


def _pairing(runs: pd.DataFrame) -> str:
    differ, unknown = ((runs["test_frames"] == found).sum() for found in ("differ", "unknown"))
    if not differ + unknown:
        return "Frames are paired: both trees test on the same paths and true poses (plans)."
    reasons = [f"in {differ} the test frames differ"] if differ else []
    reasons += [f"for {unknown} a tree lacks plans/<scene>/test.csv"] if unknown else []
    return (
        f"Frames are paired in {len(runs) - differ - unknown} of {len(runs)} runs; the intervals of"
        f" the others are unpaired, hence wider: {' and '.join(reasons)}."
    )


def run_rows(comparison: Comparison) -> Rows:
    """Tabulate each run and yardstick; a data set is named in its first row.

    Where the labels are the true poses, both yardsticks are one.
    """
    errors = ("position A", "B", "B−A", "95 %", "", "orientation A", "B", "B−A", "95 %", "")
    rows: Rows = [("data set", "model", "against", *errors, "paths")]
    shown = ""
    for key, run in comparison.table.groupby(list(KEY), sort=False):
        *parts, model = map(str, key)
        data_set, by_measure = "/".join(parts), {row.measure: row for row in rows_of(run)}
        yardsticks = {"both": ""} if one_yardstick(run) else {"labels": "", "true": "_true"}
        for place, (against, end) in enumerate(yardsticks.items()):
            position, orientation = (by_measure[f"{m}{end}"] for m in MEASURES[:2])
            names = ("" if data_set == shown else data_set, "" if place else model, against)
            paths = min(position.n_paths_a, position.n_paths_b)
            rows.append((*names, *_cells(position, 3), *_cells(orientation, 2), str(paths)))
            shown = data_set
    return rows


def _cells(row: Any, digits: int) -> tuple[str, ...]:
    """Format both errors, their difference, its limits, and the verdict."""
    number, signed = f"{{:.{digits}f}}", f"{{:+.{digits}f}}"
    errors = ["failed" if math.isinf(e) else number.format(e) for e in (row.a, row.b)]
    low, difference, high = (_signed(v, signed) for v in (row.low, row.difference, row.high))
    doubt = "?" if min(row.n_paths_a, row.n_paths_b) < FEWEST_PATHS else ""
    verdict = UNSEEN if row.verdict == VERDICTS["unseen"] else row.verdict + doubt
    return (*errors, difference, f"[{low}, {high}]", verdict)


def _signed(value: float, form: str = "{:+.1f} %") -> str:
    """Format a number with its sign, e.g. ``+3.1 %``."""
    if math.isinf(value):
        return "+∞" if value > 0 else "-∞"
    return form.format(value) if value else "0"


def change_rows(changes: pd.DataFrame) -> Rows:
    """Tabulate the first keys of ``provenance.json`` that differ."""
    rows: Rows = [("provenance.json", "A", "B")]
    for key, *values in changes.fillna("(none)").head(MOST_CHANGES).itertuples(index=False):
        texts = (v if len(v) <= WIDEST_VALUE else f"{v[: WIDEST_VALUE - 1]}…" for v in values)
        rows.append((key, *texts))
    if len(changes) > MOST_CHANGES:
        rows.append((f"… and {len(changes) - MOST_CHANGES} more", "", ""))
    return rows
