"""The robustness table as it is printed: effects down, methods across, a block a training set."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from baselines.references.registry import REFERENCES
from baselines.references.robustness import NEAREST
from synfeal.frames import write_frame
from synfeal.report.layouts import TITLES
from synfeal.report.sheet import LINE, VALUE, Sheet, with_bold, write_latex

NAME = "robustness"
CLEAN, MIXED = "clean", "mixed"
BLOCKS = {CLEAN: "Trained on ideal frames", MIXED: "Trained on frames with effects mixed in"}
FORMS = {"position_m": ("{:.2f} m", 2), "orientation_deg": ("{:.1f}°", 1)}


def write_robustness(table: pd.DataFrame, out_csv: Path, out_tex: Path) -> None:
    """Write what :func:`baselines.references.robustness.robustness_table` found, and its LaTeX."""
    write_frame(out_csv, table)
    write_latex(out_tex, robustness_sheet(table))


def robustness_sheet(table: pd.DataFrame) -> Sheet:
    """A row for each of the effects; the lowest error of each method and block is bold."""
    titles = {**TITLES, NEAREST: REFERENCES[NEAREST].title}
    rows = table[["trained_on", "effects"]].drop_duplicates()
    blocks = rows.groupby("trained_on", sort=False).ngroup()
    rows = rows.iloc[blocks.argsort(kind="stable")].reset_index(drop=True)
    cells = table.merge(rows.rename_axis(index="line").reset_index())
    failed = cells[list(FORMS)].isna().any(axis=1)
    parts = [
        pd.DataFrame(
            {
                "line": cells.line,
                "column": cells.method.map(titles),
                "place": place,
                "text": cells[measure]
                .map(form.format)
                .where(~failed, "failed" if not place else ""),
                "number": cells[measure].round(digits).where(~failed),
                **{"tone": "", "note": "", "block": cells.trained_on},
            }
        )[~(failed & (place > 0))]
        for place, (measure, (form, digits)) in enumerate(FORMS.items())
    ]
    values = pd.concat(parts, ignore_index=True)
    lines = pd.DataFrame(
        {
            "block": rows.trained_on.map(BLOCKS),
            "row": rows.index,
            **{"kind": "truth", "label_note": "", "against": "true poses"},
            "label": rows.effects.map(_label),
        }
    )
    return Sheet(
        NAME,
        "The same test paths rendered with effects of a camera and of changing light (config, "
        "robustness): median errors against the true poses.",
        ("Test frames", "Against", *(titles[method] for method in table.method.unique())),
        lines[list(LINE)],
        with_bold(values, [values[key] for key in ("block", "column", "place")])[list(VALUE)],
    )


def _label(effects: str) -> str:
    name, _, strength = effects.rpartition("_")
    return f"{name.replace('_', ' ')}, strength {strength}" if strength.isdigit() else effects
