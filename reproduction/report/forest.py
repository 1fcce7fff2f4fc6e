"""Forest plot of the pooled replications: what is printed, each replication, and all together.

    python -m reproduction.report.forest results/published/replications

draws ``claims.png`` there, beside the pooled tables.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reproduction.figures.style import BLUE, GREEN, VERMILION, Style
from reproduction.replications.effects import NETWORKS
from reproduction.replications.pooling import POOLED
from reproduction.replications.tables import REMEDY, read_pooled
from reproduction.report.stamped import digest, stamped_png, write_stamped
from synfeal.errors import exit_status

PICTURE = "claims.png"
# Claims that one thing is best have a row for each rival; the nearest one decides.
BEST = "C12"
COLORS = {"position": BLUE, "orientation": VERMILION}
TICKS_PERCENT = (-80, -50, 0, 100, 300)
ROW_INCHES = 0.27


class Row(NamedTuple):
    """A part of a claim.

    Attributes:
        claim: Id of the claim.
        label: What is compared, and in which quantity.
        quantity: Position or orientation, or what else is compared.
        single: Values of the replications.
        pooled: Pooled value and its limits.
        printed: The paper's; NaN where it has no such number.
    """

    claim: str
    label: str
    quantity: str
    single: tuple[float, ...]
    pooled: tuple[float, float, float]
    printed: float


class Forest(NamedTuple):
    """Everything that the plot shows.

    Attributes:
        changes: Effects in percent.
        shares: Shares of batches.
        verdicts: Verdict of each claim by its id.
    """

    changes: list[Row]
    shares: list[Row]
    verdicts: dict[str, str]

    @property
    def digest(self) -> str:
        """Hash of what is shown."""
        verdicts = sorted(self.verdicts.items())
        return digest([str(part) for part in (*self.changes, *self.shares, *verdicts)])


def read_forest(folder: Path) -> Forest:
    """Read the pooled effects of the claims, against the true poses, beside the paper's.

    Args:
        folder: Of the pooled tables.

    Raises:
        InputError: A table cannot be read.
    """
    table, judged = read_pooled(folder)
    return Forest(
        rows_in(table, "percent"),
        rows_in(table, "share"),
        {claim: verdict for (claim, against), verdict in judged.items() if against != "labels"},
    )


def write_forest(forest: Forest, out_png: Path) -> None:
    """Draw the pooled effects as PNG."""
    write_stamped(stamped_png(lambda: forest_figure(forest), forest.digest), out_png)


def rows_in(table: pd.DataFrame, unit: str) -> list[Row]:
    """List the parts of the claims in one unit, in their order.

    Args:
        table: ``claim_effects.csv``.
        unit: ``percent`` or ``share``.
    """
    wanted = table[(table["unit"] == unit) & (table["against"].ne("labels"))]
    wanted = wanted[wanted["claim"] != NETWORKS]
    found = [
        _row(values) for _, values in wanted.groupby(["claim", "part", "quantity"], sort=False)
    ]
    best = [row for row in found if row.claim == BEST]
    nearest = max(best, key=lambda row: row.pooled[2], default=None)
    kept = [row for row in found if row.claim != BEST or row is nearest]
    return sorted(kept, key=lambda row: int(row.claim.removeprefix("C")))


def _row(values: pd.DataFrame) -> Row:
    """Gather a part of a claim from its rows, one of each replication and the pooled one."""
    (pooled,) = values[values["replication"] == POOLED].to_dict("records")
    single = values.loc[values["replication"] != POOLED, "value"]
    part, quantity = str(pooled["part"]), str(pooled["quantity"])
    return Row(
        claim=str(pooled["claim"]),
        label=part if pooled["unit"] == "share" else f"{part}, {quantity}",
        quantity=quantity,
        single=tuple(map(float, single)),
        pooled=(float(pooled["value"]), float(pooled["low"]), float(pooled["high"])),
        printed=float(pooled["printed"]),
    )


def forest_figure(forest: Forest) -> Figure:
    """Draw a row for each part: replications as ticks, the pooled value with limits, print."""
    changes, shares, verdicts = forest
    heights = [len(changes) + 1.5, len(shares) + 1.5]
    figure = Figure(figsize=(9.5, ROW_INCHES * sum(heights) + 1.2), layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=heights)
    _draw_rows(above, [_as_ratios(row) for row in changes])
    above.set_xscale("log")
    above.axvline(1, color="0.3", lw=0.8, zorder=0)
    above.set_xticks(
        [1 + percent / 100 for percent in TICKS_PERCENT],
        [f"{percent:+d} %".replace("-", "−") if percent else "0" for percent in TICKS_PERCENT],
    )
    above.minorticks_off()
    above.set_xlabel("change (0: none; the axis is that of ratios)")
    _draw_rows(below, shares)
    below.set_xlim(0, 1)
    below.set_xlabel("share of batches that needed assistance")
    for axes, rows in ((above, changes), (below, shares)):
        _name_claims(axes, rows, verdicts)
    handles, titles = above.get_legend_handles_labels()
    shown = dict(zip(titles, handles, strict=True))
    figure.legend(shown.values(), shown, loc="outside upper center", ncols=len(shown))
    return figure


def _as_ratios(row: Row) -> Row:
    """Convert changes in percent to ratios."""
    value, low, high = (1 + number / 100 for number in row.pooled)
    return row._replace(
        single=tuple(1 + number / 100 for number in row.single),
        pooled=(value, low, high),
        printed=1 + row.printed / 100,
    )


def _draw_rows(axes: Axes, rows: Sequence[Row]) -> None:
    for y, row in enumerate(rows):
        color = COLORS.get(row.quantity, GREEN)
        value, low, high = row.pooled
        axes.plot(row.single, [y] * len(row.single), "|", color=color, ms=7, mew=0.9, zorder=2)
        axes.plot([low, high], [y, y], color=color, lw=2.2, solid_capstyle="butt", zorder=2)
        name = row.quantity if row.quantity in COLORS else "other"
        pooled: Style = {"color": color, "ms": 5.5, "mec": "white", "mew": 0.7, "zorder": 3}
        axes.plot(value, y, "o", label=f"{name}, pooled", **pooled)
        if math.isfinite(row.printed):
            printed: Style = {"mfc": "white", "mec": "0.25", "mew": 1.1, "ms": 5.5, "zorder": 4}
            axes.plot(row.printed, y, "D", label="the paper", **printed)
    axes.set_yticks(range(len(rows)), [row.label for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color="0.92")
    axes.spines["left"].set_visible(False)


def _name_claims(axes: Axes, rows: Sequence[Row], verdicts: dict[str, str]) -> None:
    """Write each claim with its verdict beside its first row, and rule a line above it."""
    before = None
    for y, row in enumerate(rows):
        if row.claim != before:
            axes.annotate(
                f"{row.claim}: {verdicts.get(row.claim, 'not judged')}",
                (1.01, y),
                xycoords=("axes fraction", "data"),
                va="center",
                fontsize=8,
                annotation_clip=False,
            )
            if y:
                axes.axhline(y - 0.5, color="0.85", lw=0.7, zorder=0)
        before = row.claim


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="of the pooled tables")
    folder = parser.parse_args(arguments).folder
    return exit_status(lambda: write_forest(read_forest(folder), folder / PICTURE), REMEDY)


if __name__ == "__main__":
    sys.exit(main())
