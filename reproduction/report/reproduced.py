"""What of the paper was reproduced and what was not: five lines that the read-me opens with."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from baselines.config.learning import MODELS
from reproduction.report.findings import paired_changes, percent
from reproduction.report.paper_cells import SIZES, order_of_networks, paper_cells, ratios
from reproduction.report.published_claims import read_published
from reproduction.tables.layouts import TITLES
from synfeal.errors import InputError

CHANGES = re.compile(r"p ([+-]?\d+) %, o ([+-]?\d+) %")
# Published runs that the lines are told by: of those with fresh seeds and test frames of whole
# paths the ones with most training runs.
ROOM, SANCTUARY, LABELS = "controls", "more_sanctuary", "labels"


def reproduced(root: Path) -> str:
    """Tell in a line each what was reproduced, most important first.

    Args:
        root: Published results whose Table 4 is compared, among other published ones.

    Raises:
        InputError: The run has no Table 4, or another that a line is told by is not published.
    """
    if not (root / "tables" / f"{SIZES}.csv").is_file():
        raise InputError(root, "has no Table 4", "publish again")
    lines: tuple[Callable[[Path], str], ...] = (_size, _noise, _networks, _labels, _start)
    return "\n".join(f"- {line(root)}" for line in lines)


def _size(root: Path) -> str:
    room, sanctuary = (
        _effect(root.with_name(run), claim) for run, claim in ((ROOM, "C7"), (SANCTUARY, "C8"))
    )
    return (
        "**Reproduced: more frames, smaller errors.** Mean over the five networks, 6k to 80k frames"
        f" of the Large Room {room}; 6k to 95k of the Sanctuary {sanctuary}."
    )


def _noise(root: Path) -> str:
    return (
        "**Same direction, smaller: noise in the labels.** Labels 0.30 m and 20° off change"
        f" PoseNet2's errors by {_effect(root.with_name(LABELS), 'C6')}."
    )


def _networks(root: Path) -> str:
    cells = paper_cells(root)
    within, of_networks = zip(
        *(order_of_networks(cells, quantity) for quantity in ("position", "orientation")),
        strict=True,
    )
    times = ratios(cells, "position")
    text = ", ".join(f"{TITLES[model]} {times[model]:.2f}" for model in MODELS)
    rows = len(set(cells[cells.table == SIZES].row))
    return (
        "**Not reproduced: the order of the networks.** Rank correlation with print among the five"
        f" networks, mean over the {rows} rows of Table 4: {_signed(within[0])} in position and"
        f" {_signed(within[1])} in orientation (among the rows, mean over the networks:"
        f" {_signed(of_networks[0])} and {_signed(of_networks[1])}). Our position error over the"
        f" printed one: {text}."
    )


def _labels(root: Path) -> str:
    return (
        "**Not reproduced: better labels, better networks.** Simulator labels instead of SfM's"
        f" change PoseNet2's errors by {_effect(root.with_name(LABELS), 'C2')}."
    )


def _start(root: Path) -> str:
    row = _claim(root.with_name(ROOM), "C10")
    return (
        f"**Open: transfer learning.** At 6k and 20k frames {row['measured_true']} (printed: 20 of"
        " 20), by too little to decide."
    )


def _effect(run: Path, claim: str) -> str:
    """Format both changes of a claim with limits, and the printed ones."""
    changes, found = paired_changes(run, claim), CHANGES.search(_claim(run, claim)["published"])
    if changes is None or found is None:
        raise InputError(run, f"does not judge {claim}", "publish again")
    position, orientation = (f"{int(text):+d} %".replace("-", "−") for text in found.groups())
    return (
        f"{percent(changes[0])} in position and {percent(changes[1])} in orientation (printed:"
        f" {position}, {orientation})"
    )


def _claim(run: Path, claim: str) -> dict[str, str]:
    rows = {row["id"]: row for row in read_published(run)}
    if claim not in rows:
        raise InputError(run, f"does not judge {claim}", "publish again")
    return rows[claim]


def _signed(number: float) -> str:
    return f"{number:+.2f}".replace("-", "−")
