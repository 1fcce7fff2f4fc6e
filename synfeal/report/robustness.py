"""The robustness table as it is printed: effects down, methods across, a block a training set."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd

from baselines.references.registry import REFERENCES
from baselines.references.robustness import NEAREST
from synfeal.frames import write_frame
from synfeal.report.grid import Entry, Grid, Group, Line, Value, with_bold
from synfeal.report.latex import write_latex
from synfeal.report.layouts import TITLES

NAME = "robustness"
CLEAN, MIXED = "clean", "mixed"
BLOCKS = {CLEAN: "Trained on ideal frames", MIXED: "Trained on frames with effects mixed in"}


def write_robustness(table: pd.DataFrame, out_csv: Path, out_tex: Path) -> None:
    """Write what :func:`baselines.references.robustness.robustness_table` found, and its LaTeX."""
    write_frame(out_csv, table)
    write_latex(out_tex, robustness_grid(table))


def robustness_grid(table: pd.DataFrame) -> Grid:
    """A row for each of the effects; the best method of each is not marked, the change is read."""
    methods = list(dict.fromkeys(table.method))
    groups = []
    for trained_on, block in table.groupby("trained_on", sort=False):
        cells = block.set_index(["effects", "method"])
        lines = [
            (_line(effects, [cells.loc[(effects, method)] for method in methods]),)
            for effects in dict.fromkeys(block.effects)
        ]
        groups.append(Group(BLOCKS[str(trained_on)], with_bold(lines)))
    titles = {**TITLES, NEAREST: REFERENCES[NEAREST].title}
    return Grid(
        NAME,
        "The same test paths rendered with effects of a camera and of changing light (config, "
        "robustness): median errors against the true poses.",
        ("Test frames", "Against", *(titles[method] for method in methods)),
        tuple(groups),
    )


def _line(effects: str, cells: list[pd.Series]) -> Line:
    name, _, strength = effects.rpartition("_")
    label = f"{name.replace('_', ' ')}, strength {strength}" if strength.isdigit() else effects
    return Line("truth", label, "true poses", tuple(_entry(cell) for cell in cells))


def _entry(cell: pd.Series) -> Entry:
    if math.isnan(cell.position_m) or math.isnan(cell.orientation_deg):
        return Entry((Value("failed"),))
    position, orientation = round(cell.position_m, 2), round(cell.orientation_deg, 1)
    values = Value(f"{position:.2f} m", position), Value(f"{orientation:.1f}°", orientation)
    return Entry(values)
