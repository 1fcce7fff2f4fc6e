"""Forest plot of the claims: what is printed, each replication, and all together.

    python -m reproduction.report.forest results/published/replications

draws ``claims.png`` there, beside the pooled tables.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Collection, Sequence
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reproduction.claims.effects import BEST_NETWORK
from reproduction.claims.tables import (
    PERCENT,
    SHARE,
    Part,
    nearest_rival,
    parts_in,
    read_claims,
)
from reproduction.claims.verdicts import Verdict, published_claims
from reproduction.figures.style import BLUE, GREEN, VERMILION, Style
from reproduction.report.claim_lines import OUTCOMES, part_label
from reproduction.report.stamped import digest, stamped_png, write_stamped
from synfeal.errors import exit_status

PICTURE = "claims.png"
REMEDY = "pool the replications again: python -m reproduction.replications pool"
COLORS = {"position": BLUE, "orientation": VERMILION}
TICKS_PERCENT = (-80, -50, 0, 100, 300)
ROW_INCHES = 0.29
LEAST_ROWS = 2  # of a claim, whose title and verdict are two lines
ASIDE = 0.27  # rows; where limits are narrow, replications would hide under the pooled value
AS_IN_PRINT = "against the labels, as in print"
BEST_TITLE = "PoseNet2 is the best network"


class Forest(NamedTuple):
    """Everything that the plot shows.

    Attributes:
        changes: Effects in percent.
        shares: Shares of batches.
        verdicts: Verdict of each claim by its id.
        against_labels: Effects of the claims that print measures against estimated or noisy labels,
            measured like that.
        best_network: The network that is best in print, beside its surest rival; empty where no
            replication compares networks.
    """

    changes: list[Part]
    shares: list[Part]
    verdicts: dict[str, str]
    against_labels: list[Part]
    best_network: list[Part]

    def of_claims(self, claims: Collection[str]) -> Forest:
        """Keep the changes of some claims and the best network; call verdicts as the lines do."""
        kept = [part for part in self.changes if part.claim in claims]
        return self._replace(
            changes=[*kept, *self.best_network],
            shares=[],
            verdicts={
                claim: OUTCOMES[Verdict(verdict)].lower()
                for claim, verdict in self.verdicts.items()
                if verdict in OUTCOMES
            },
        )

    @property
    def digest(self) -> str:
        """Hash of what is shown."""
        verdicts = sorted(self.verdicts.items())
        parts = (*self.changes, *self.shares, *self.against_labels, *verdicts)
        return digest([str(part) for part in parts])


def read_forest(folder: Path) -> Forest:
    """Read the effects of the claims, against the true poses, beside the paper's.

    Args:
        folder: Of the tables of pooled replications, or of single runs.

    Raises:
        InputError: A table cannot be read.
    """
    table, judged, _ = read_claims(folder)
    parts, against_labels = parts_in(table), parts_in(table, "labels")
    best = nearest_rival(table, BEST_NETWORK)
    return Forest(
        changes=[part for part in parts if part.unit == PERCENT],
        shares=[part for part in parts if part.unit == SHARE],
        verdicts={
            claim: verdict for (claim, against), verdict in judged.items() if against != "labels"
        },
        against_labels=[part for part in against_labels if (part.claim, "labels") in judged],
        best_network=[best] if best else [],
    )


def write_forest(forest: Forest, out_png: Path) -> None:
    """Draw the effects into a file, as PNG."""
    write_stamped(forest_picture(forest), out_png)


def forest_picture(forest: Forest) -> bytes:
    """Draw the effects as PNG."""
    return stamped_png(lambda: forest_figure(forest), forest.digest)


def forest_figure(forest: Forest) -> Figure:
    """Draw a row for each part: replications as ticks, the pooled value with limits, print."""
    changes, shares, verdicts = forest.changes, forest.shares, forest.verdicts
    blocks = [rows for rows in (changes, shares) if rows]
    heights = [_places(rows)[1] + 1.5 for rows in blocks]
    figure = Figure(figsize=(9.5, ROW_INCHES * sum(heights) + 1.0), layout="constrained")
    above, *below = figure.subplots(len(blocks), 1, height_ratios=heights, squeeze=False)[:, 0]
    _draw_rows(above, [_as_ratios(row) for row in changes])
    _draw_against_labels(above, changes, [_as_ratios(row) for row in forest.against_labels])
    above.set_xscale("log")
    above.axvline(1, color="0.3", lw=0.8, zorder=0)
    above.set_xticks(
        [1 + percent / 100 for percent in TICKS_PERCENT],
        [f"{percent:+d} %".replace("-", "−") if percent else "0" for percent in TICKS_PERCENT],
    )
    above.minorticks_off()
    above.set_xlabel("change of the median error, on the scale of ratios")
    for axes in below:
        _draw_rows(axes, shares)
        axes.set_xlim(0, 1)
        axes.set_xlabel("share of batches that needed assistance")
    for axes, rows in zip((above, *below), blocks, strict=True):
        _name_claims(axes, rows, verdicts)
    handles, titles = above.get_legend_handles_labels()
    shown = dict(zip(titles, handles, strict=True))
    if any(row.single for row in changes):
        tick: Style = {"ls": "", "color": "0.25", "ms": 7, "mew": 0.9}
        shown["one replication"] = Line2D([], [], marker="|", **tick)
    figure.legend(shown.values(), shown, loc="outside upper center", ncols=len(shown))
    return figure


def _as_ratios(row: Part) -> Part:
    """Convert changes in percent to ratios."""
    value, low, high = (1 + number / 100 for number in row.decided)
    return row._replace(
        single=tuple(1 + number / 100 for number in row.single),
        decided=(value, low, high),
        printed=1 + row.printed / 100,
    )


def _places(rows: Sequence[Part]) -> tuple[list[int], int]:
    """Place rows below each other; return where each is, and how many places there are."""
    places, end = [], 0
    for _, of_claim in groupby(rows, key=lambda row: row.claim):
        start = end
        places += [start + n for n, _ in enumerate(of_claim)]
        end = max(places[-1] + 1, start + LEAST_ROWS)
    return places, end


def _draw_rows(axes: Axes, rows: Sequence[Part]) -> None:
    places, end = _places(rows)
    for y, row in zip(places, rows, strict=True):
        color = COLORS.get(row.quantity, GREEN)
        value, low, high = row.decided
        below = [y + ASIDE] * len(row.single)
        axes.plot(row.single, below, "|", color=color, ms=4.5, mew=0.9, zorder=2)
        axes.plot([low, high], [y, y], color=color, lw=2.2, solid_capstyle="butt", zorder=2)
        name = row.quantity if row.quantity in COLORS else "other"
        told = "pooled" if row.single else "ours"
        decided: Style = {"color": color, "ms": 4, "mec": "white", "mew": 0.5, "zorder": 3}
        axes.plot(value, y, "o", label=f"{name}, {told}", **decided)
        if math.isfinite(row.printed):
            printed: Style = {"mfc": "white", "mec": "0.25", "mew": 1.1, "ms": 5.5, "zorder": 4}
            axes.plot(row.printed, y, "D", label="the paper", **printed)
    axes.set_yticks(places, [part_label(row) for row in rows])
    axes.set_ylim(end - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color="0.92")
    axes.spines["left"].set_visible(False)


def _draw_against_labels(axes: Axes, rows: Sequence[Part], as_printed: Sequence[Part]) -> None:
    """Draw effects as print measures them, above those that are against the true poses."""
    places = {(row.claim, row.label): y for y, row in zip(_places(rows)[0], rows, strict=True)}
    for row in as_printed:
        if (row.claim, row.label) in places:
            y = places[row.claim, row.label] - ASIDE
            color = COLORS.get(row.quantity, GREEN)
            value, low, high = row.decided
            axes.plot([low, high], [y, y], color=color, lw=1, solid_capstyle="butt", zorder=2)
            hollow: Style = {"color": color, "mfc": "white", "ms": 4, "mew": 1, "zorder": 3}
            axes.plot(value, y, "o", label=AS_IN_PRINT, **hollow)


def _name_claims(axes: Axes, rows: Sequence[Part], verdicts: dict[str, str]) -> None:
    """Write each claim with its verdict beside its first row, and rule a line above it."""
    titles = {claim.id: f"{claim.title} ({claim.id})" for claim in published_claims()}
    titles[BEST_NETWORK] = BEST_TITLE
    before = None
    for y, row in zip(_places(rows)[0], rows, strict=True):
        if row.claim != before:
            axes.annotate(
                f"{titles[row.claim]}\n{verdicts.get(row.claim, 'not judged')}",
                (1.01, y - 0.3),
                xycoords=("axes fraction", "data"),
                va="top",
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
