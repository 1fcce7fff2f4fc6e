"""Findings on real photographs, in sentences and as a table for pages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.real.design import BOTH, GIVEN, PHOTOGRAPHS, RANDOMISED, RENDERED, SFM
from reproduction.tables.columns import side_sheet
from reproduction.tables.layouts import TITLES
from reproduction.tables.real import DIRECTIONS, LOST, METHODS, NAME, read_real, side_layout
from reproduction.tables.sheet import markdown_table, sheet_markdown
from synfeal.records.tables import COUNT, NUMBER, TEXT, read_frame, rows_of

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


# Rows of the short table: labels of the whole chain, what is learnt from, method (None: the best
# localizer). Those by structure from motion come first: those by depth SLAM are off by several
# centimetres themselves, which no method can undercut.
SHORT = (
    (SFM, RENDERED, "structure"),
    (SFM, RANDOMISED, HEADLINE),
    (GIVEN, PHOTOGRAPHS, "structure"),
    (GIVEN, RENDERED, "structure-refined"),
    (GIVEN, RENDERED, "structure"),
    (GIVEN, BOTH, None),
    (GIVEN, RANDOMISED, None),
    (GIVEN, RANDOMISED, HEADLINE),
    (GIVEN, RENDERED, HEADLINE),
    (GIVEN, PHOTOGRAPHS, HEADLINE),
    (GIVEN, RENDERED, "retrieval"),
)
SHORTEST = (
    (SFM, RENDERED, "structure"),
    (SFM, RANDOMISED, HEADLINE),
    (GIVEN, RENDERED, "structure"),
)
LABELS = {SFM: "SfM", GIVEN: "depth SLAM"}
# Poses that others published (benchmarks/published_poses.py), by what that repository calls them.
OTHERS = {"hloc": "hloc", "as": "Active Search"}
OTHERS_URL = "https://github.com/tsattler/visloc_pseudo_gt_limitations"
OTHERS_LABELS = {SFM: "sfm", GIVEN: "dslam"}
OTHERS_COLUMNS = {
    "labels": TEXT,
    "method": TEXT,
    **dict.fromkeys(("position_m", "orientation_deg", "recall_5cm_5deg"), NUMBER),
    "n_test": COUNT,
}


def real_headline(root: Path, others: Path) -> str:
    """Tabulate the rows of a published run that a visitor wants to see first.

    Args:
        root: The published run.
        others: ``published_poses.csv``, scores of poses that others published of the same room.
    """
    main = _main_direction(root)
    published = read_frame(others, OTHERS_COLUMNS)
    note = (
        f"\\* Poses that [Brachmann et al.]({OTHERS_URL})"
        " publish of other photographs of the same room, its"
        f" {int(published.n_test.iloc[0]):,} test"
        " photographs, in a map of its training photographs. *Labels*: poses that the whole chain,"
        " from the scan on, is made from and scored against. Those of depth SLAM are themselves off"
        " by centimetres, so that every method that matches images seems worse by them. Rendered"
        " cameras fill the box and headings of all photographs, those to be localized included."
    )
    shown = _table_beside_others(main, published, SHORT)
    worth = _worth(main[main.labels == GIVEN])
    return "\n\n".join([_split_of(main), shown, note, *worth])


def real_short(root: Path, others: Path) -> str:
    """Tabulate the three rows of a published run that the read-me shows, beside others' poses.

    Args:
        root: The published run.
        others: As for :func:`real_headline`.
    """
    main = _main_direction(root)
    return _table_beside_others(main, read_frame(others, OTHERS_COLUMNS), SHORTEST)


def _main_direction(root: Path) -> pd.DataFrame:
    """Read the rows of a run's first way to part the photographs."""
    table = read_real(root / "tables" / f"{NAME}.csv")
    main: pd.DataFrame = table[table.direction == table.direction.iloc[0]]
    return main


def _split_of(main: pd.DataFrame) -> str:
    direction = DIRECTIONS[str(main.direction.iloc[0])]
    return f"{direction}; {int(main.n_test.iloc[0]):,} photographs:"


def _table_beside_others(
    main: pd.DataFrame, published: pd.DataFrame, shown: Sequence[tuple[str, str, str | None]]
) -> str:
    """Format chosen rows by labels, each followed by what others reach on these labels."""
    lines: list[dict[str, str]] = []
    for labels, words in LABELS.items():
        own = main[main.labels == labels]
        if own.empty:
            continue
        for trained_on, method in (row[1:] for row in shown if row[0] == labels):
            row = _best(own, trained_on) if method is None else _one(own, trained_on, method)
            if row is not None:
                lines.append({"labels": words, **_short_row(row, labels, trained_on, method)})
        scored = published[published.labels == OTHERS_LABELS[labels]]
        rows = rows_of(scored[scored.method.isin(list(OTHERS))])
        lines.extend({"labels": words, **_others_row(row)} for row in rows)
    return markdown_table(pd.DataFrame(lines))


def _short_row(row: Any, labels: str, trained_on: str, method: str | None) -> dict[str, str]:
    """Format a row of the run, by the labels that its whole chain is made from."""
    end = "_sfm" if labels == SFM else ""
    error = {
        name: getattr(row, f"{name}{end}")
        for name in ("position_m", "position_m_low", "position_m_high", "orientation_deg")
    }
    share = [getattr(row, f"recall_5cm_5deg{limit}{end}") for limit in ("", "_low", "_high")]
    return {
        "method": METHODS[row.method] + (" (best of five)" if method is None else ""),
        "learned or mapped from": SOURCES[trained_on],
        "median error (95 % limits)": _in_cm(**error),
        "within 5 cm and 5°": f"{_percent(share[0])} % ({' – '.join(map(_percent, share[1:]))})",
    }


def _others_row(row: Any) -> dict[str, str]:
    """Format a row of the poses that others published."""
    return {
        "method": f"*{OTHERS[row.method]}*\\*",
        "learned or mapped from": "photographs, of other sequences",
        "median error (95 % limits)": f"{100 * row.position_m:.1f} cm, {row.orientation_deg:.1f}°",
        "within 5 cm and 5°": f"{_percent(row.recall_5cm_5deg)} %",
    }


def _percent(share: float) -> str:
    """Format a share, so that what is not all does not read 100."""
    return f"{100 * share:.{1 if 0.99 < share < 1 else 0}f}"


def _in_cm(
    position_m: float, position_m_low: float, position_m_high: float, orientation_deg: float
) -> str:
    """Format both errors, the position with its limits."""
    if not math.isfinite(position_m):
        return LOST
    low, high = 100 * position_m_low, 100 * position_m_high
    digits = 1 if high < 10 else 0
    limits = f"{low:.{digits}f} – {high:.{digits}f}"
    return f"{100 * position_m:.1f} cm ({limits}), {orientation_deg:.1f}°"


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
