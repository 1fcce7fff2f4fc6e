"""Findings on real photographs, in sentences and as a table for pages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.real.design import BOTH, GIVEN, PHOTOGRAPHS, RANDOMISED, RENDERED, SFM
from reproduction.tables.columns import side_sheet
from reproduction.tables.layouts import TITLES
from reproduction.tables.real import DIRECTIONS, LOST, METHODS, NAME, read_real, side_layout
from reproduction.tables.sheet import markdown_table, sheet_markdown
from synfeal.records.tables import rows_of

HEADLINE = "posenet2"
# What localizers learn from and maps are built of, in sentences.
SOURCES = {
    RANDOMISED: "randomised renderings",
    RENDERED: "renderings",
    PHOTOGRAPHS: "photographs of the scan",
    BOTH: "renderings and photographs of the scan",
}


def real_findings(root: Path) -> str:
    """Say what a published run found, a sentence each."""
    table = read_real(root / "tables" / f"{NAME}.csv")
    return "\n".join(f"- {sentence}" for sentence in sentences(table))


# Rows of the short table: what they learn from, method (None: the best localizer), and in words.
SHORT = (
    (PHOTOGRAPHS, HEADLINE, "photographs of the scan"),
    (RENDERED, HEADLINE, "renderings as they are"),
    (RANDOMISED, HEADLINE, "randomised renderings"),
    (RANDOMISED, None, "randomised renderings"),
    (BOTH, None, "randomised renderings and photographs of the scan"),
    (RENDERED, "structure", "renderings"),
    (RENDERED, "structure-refined", "renderings"),
    (RENDERED, "retrieval", "renderings"),
)


def real_headline(root: Path) -> str:
    """Tabulate the few rows of a published run that a visitor wants to see first."""
    table = read_real(root / "tables" / f"{NAME}.csv")
    given = table[table.labels == GIVEN]
    main = given[given.direction == given.direction.iloc[0]]
    lines = []
    for trained_on, method, words in SHORT:
        row = _best(main, trained_on) if method is None else _one(main, trained_on, method)
        if row is None:
            continue
        name = METHODS[row.method]
        of_all = " (best of five)" if method is None else ""
        lines.append(
            {
                "method": f"{name}{of_all}",
                "learned or mapped from": words,
                "median error (95 % limits)": _in_cm(row),
                "within 5 cm and 5°": f"{100 * row.recall_5cm_5deg:.0f} %",
                "seeds": str(row.n_seeds),
            }
        )
    shown = markdown_table(pd.DataFrame(lines))
    direction = DIRECTIONS[str(main.direction.iloc[0])]
    head = f"{direction}; {int(main.n_test.iloc[0]):,} photographs:"
    return "\n\n".join([head, shown, *_worth(main)])


def _in_cm(row: Any) -> str:
    """Format both errors of a row, the position with its limits."""
    if not math.isfinite(row.position_m):
        return LOST
    low, high = 100 * row.position_m_low, 100 * row.position_m_high
    return f"{100 * row.position_m:.1f} cm ({low:.0f} – {high:.0f}), {row.orientation_deg:.1f}°"


def _worth(table: pd.DataFrame) -> Iterator[str]:
    """Say what renderings are worth beside photographs of the scan, as they are and randomised."""
    plain, randomised = (_one(table, source, HEADLINE) for source in (RENDERED, RANDOMISED))
    if plain is None or randomised is None or not math.isfinite(plain.times_position):
        return
    yield (
        f"Randomised renderings have random light, lenses and sensors. Trained on them,"
        f" {TITLES[HEADLINE]} is {randomised.times_position:.1f} times as exact as trained on"
        f" photographs of the scan ({_limits(randomised)}); trained on renderings as they are,"
        f" {plain.times_position:.1f} times ({_limits(plain)})."
    )


def _best(table: pd.DataFrame, trained_on: str) -> Any | None:
    """Return the localizer with the lowest position error."""
    trained = table[table.method.isin(list(TITLES)) & (table.trained_on == trained_on)]
    rows = rows_of(trained.sort_values("position_m"))
    return rows[0] if len(rows) > 1 and math.isfinite(rows[0].position_m) else None


def real_table(root: Path) -> str:
    """Format the table of a published run."""
    table = read_real(root / "tables" / f"{NAME}.csv")
    return sheet_markdown(side_sheet(side_layout(table))).rstrip()


def sentences(table: pd.DataFrame) -> Iterator[str]:
    """Put a table into sentences: by direction, by localizer, by source of labels."""
    given = table[table.labels == GIVEN]
    main = given.direction.iloc[0]
    for direction in given.direction.unique():
        of = given[given.direction == direction]
        yield from _direction(of, str(direction))
    yield from _localizers(given[given.direction == main])
    yield from _structure(given[given.direction == main])
    yield from _labels(table[table.direction == main])


def _one(table: pd.DataFrame, trained_on: str, method: str) -> Any | None:
    found = rows_of(table[(table.trained_on == trained_on) & (table.method == method)])
    return found[0] if found else None


def _direction(table: pd.DataFrame, direction: str) -> Iterator[str]:
    rendered = _one(table, RANDOMISED, HEADLINE)
    photographs = _one(table, PHOTOGRAPHS, HEADLINE)
    if rendered is None or photographs is None:
        return
    times = f"{rendered.times_position:.1f} times as exact ({_limits(rendered)})"
    seeds = (
        f"Worst of {rendered.n_seeds} seeds: {rendered.position_m_worst:.3f} m."
        if rendered.n_seeds > 1
        else "One seed."
    )
    yield (
        f"{DIRECTIONS[direction]}: on {rendered.n_test:,} photographs, {TITLES[HEADLINE]} is off by"
        f" {_pose(rendered)} when trained only on renderings of the scan, and by"
        f" {_pose(photographs)} when trained on the scan's photographs. With renderings it is"
        f" {times}. {seeds}"
    )


def _limits(row: Any) -> str:
    return f"95 % limits {row.times_position_low:.1f} to {row.times_position_high:.1f}"


def _pose(row: Any) -> str:
    return _written(row.position_m, row.orientation_deg)


def _written(position_m: float, orientation_deg: float) -> str:
    if not math.isfinite(position_m):
        return LOST
    return f"{position_m:.3f} m / {orientation_deg:.1f}°"


def _localizers(table: pd.DataFrame) -> Iterator[str]:
    trained = table[table.method.isin(list(TITLES))]
    for trained_on, source in SOURCES.items():
        rows = rows_of(trained[trained.trained_on == trained_on].sort_values("position_m"))
        if len(rows) < 2:
            continue
        best, worst = rows[0], rows[-1]
        yield (
            f"Trained on {source}, the {len(rows)} localizers have errors from {_pose(best)}"
            f" ({TITLES[best.method]}) to {_pose(worst)} ({TITLES[worst.method]})."
            f"{_ratios([row for row in rows if math.isfinite(row.times_position)])}"
        )


def _ratios(rows: list[Any]) -> str:
    """Compare several localizers with the same ones trained on photographs."""
    if len(rows) < 2:
        return ""
    lowest, *_, highest = sorted(row.times_position for row in rows)
    apart = sum(row.times_position_low > 1 or row.times_position_high < 1 for row in rows)
    return (
        f" They are {lowest:.1f} to {highest:.1f} times as exact as the same networks trained on"
        f" photographs of the scan; the 95 % limits of {apart} of the {len(rows)} ratios exclude 1."
    )


def _structure(table: pd.DataFrame) -> Iterator[str]:
    for row in rows_of(table[table.method.isin(["structure", "structure-refined"])]):
        refined = ", refined on the scan" if row.method == "structure-refined" else ""
        yield (
            f"Structure, with a map of {SOURCES[row.trained_on]}{refined}: {_pose(row)},"
            f" {100 * row.recall_5cm_5deg:.0f} % within 5 cm and 5°,"
            f" {100 * row.localized:.0f} % localized."
        )
    floors = [_one(table, RENDERED, name) for name in ("retrieval", "nearest")]
    mean = _one(table, PHOTOGRAPHS, "mean")
    if mean is not None and all(floors):
        alike, nearest = floors
        yield (
            f"For comparison: the rendered frame that looks most alike is off by {_pose(alike)},"
            f" the nearest rendered pose (an oracle) by {_pose(nearest)}, the mean pose by"
            f" {_pose(mean)}."
        )


def _labels(table: pd.DataFrame) -> Iterator[str]:
    """Say how much the source of labels changes, in training and in testing."""
    by_sfm = table[table.labels == SFM]
    for row in rows_of(by_sfm[by_sfm.method.isin([*TITLES, "structure"])]):
        given = _one(table[table.labels == GIVEN], row.trained_on, row.method)
        if given is None:
            continue
        name = TITLES.get(row.method, "structure")
        yield (
            f"Source of the labels, {name}: with the whole chain on SfM's labels, the error is"
            f" {_sfm(row)} against SfM's labels ({100 * row.recall_5cm_5deg_sfm:.0f} % within 5 cm"
            f" and 5°) and {_pose(row)} against those of 7-Scenes. With the whole chain on those of"
            f" 7-Scenes, it is {_pose(given)} against them and {_sfm(given)} against SfM's."
        )


def _sfm(row: Any) -> str:
    return _written(row.position_m_sfm, row.orientation_deg_sfm)
