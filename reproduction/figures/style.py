"""Style of figures: colours safe for the colour-blind; markers and dashes repeat them in grey."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import cycle
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from baselines.config.learning import LOCALIZERS
from baselines.labels.methods import METHODS

# Okabe and Ito's colours; within each set no two lines share a marker or a dash pattern.
BLACK, BLUE, VERMILION, GREEN = "#000000", "#0072B2", "#D55E00", "#009E73"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"
Style = dict[str, Any]

# Of localizers that declare no style.
SPARE_STYLES: tuple[Style, ...] = (
    {"color": ORANGE, "marker": "P", "linestyle": (0, (1, 2))},
    {"color": SKY, "marker": "X", "linestyle": (0, (8, 2))},
)
_spare = cycle(SPARE_STYLES)
MODEL_STYLES: dict[str, Style] = {
    name: dict(kind.style or next(_spare)) for name, kind in LOCALIZERS.items()
}
METHOD_STYLES: dict[str, Style] = dict(
    zip(
        METHODS,
        cycle(
            (
                {"color": BLUE, "marker": "o", "linestyle": "-"},
                {"color": VERMILION, "marker": "^", "linestyle": "--"},
                {"color": GREEN, "marker": "s", "linestyle": "-."},
                {"color": PURPLE, "marker": "D", "linestyle": ":"},
                {"color": ORANGE, "marker": "v", "linestyle": (0, (5, 1, 1, 1, 1, 1))},
                {"color": BLACK, "marker": "P", "linestyle": (0, (1, 2))},
                {"color": SKY, "marker": "X", "linestyle": (0, (8, 2))},
            )
        ),
    )
)
SPLIT_STYLES: dict[str, Style] = {
    "train": {"color": ORANGE, "marker": "o"},
    "test": {"color": BLUE, "marker": "^"},  # the darker one: drawn on top, and fewer
}
# What localizers are read against: greys, told apart by markers and dashes.
_REFERENCE_MARKS = (
    ("0.60", "x", (0, (1, 1))),
    ("0.60", "+", (0, (3, 1))),
    ("0.75", "1", "-"),
    ("0.25", "*", "-"),
    ("0.25", "h", "--"),
    ("0.25", "p", "-."),
    ("0.45", "d", (0, (5, 2))),
    ("0.25", ">", ":"),
    ("0.45", "<", (0, (3, 2))),
)


def reference_styles(names: Iterable[str]) -> dict[str, Style]:
    """Choose a style for each reference method, in order."""
    return {
        name: {"color": color, "marker": marker, "linestyle": dashes, "zorder": 1.5}
        for name, (color, marker, dashes) in zip(names, cycle(_REFERENCE_MARKS), strict=False)
    }


PUBLISHED: Style = {"color": "0.74", "linewidth": 0.9, "markersize": 3, "zorder": 1}
TRUTH: Style = {"color": "0.68", "linewidth": 3.0, "linestyle": "-"}

# Text stays text in SVG; a fixed salt gives equal numbers equal identifiers.
RC: dict[Any, Any] = {
    "font.size": 9,
    "axes.axisbelow": True,
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.titlesize": 11,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "legend.handlelength": 3.5,
    "svg.fonttype": "none",
    "svg.hashsalt": "synfeal",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}


def add_legend(figure: Figure, axes: Axes, columns: int, more: Mapping[str, Artist] = {}) -> None:
    """Add a legend below all axes of a figure.

    Args:
        figure: Figure to add it to.
        axes: Axes whose entries it lists; titles that occur several times are listed once.
        columns: Number of columns of entries.
        more: Further entries by title.
    """
    entries: dict[str, Artist] = {}
    for handle, title in zip(*axes.get_legend_handles_labels(), strict=True):
        entries.setdefault(title, handle)
    entries |= more
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns)


def set_log(axes: Axes, *which: str) -> None:
    """Make ``x``, ``y`` or both logarithmic, with ticks at 1, 2 and 5 read as plain numbers."""
    for name in which:
        axes.set(**{f"{name}scale": "log"})
        axis = {"x": axes.xaxis, "y": axes.yaxis}[name]
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
