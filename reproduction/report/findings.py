"""Findings of a run in plain words, most important first: each number with its 95 % limits.

They are about its reference methods and Table 6; what its claims tell is in
:mod:`reproduction.report.claim_findings`. Every finding says whether errors are against the labels
of the test set, as in the paper, or against the true poses. A run that lacks the rows of a finding
has one finding less.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from baselines.labels.methods import SIMULATOR
from reproduction.claims.label_shapes import NAME as SHAPE_CHANGES
from reproduction.claims.label_shapes import SCHEMA as SHAPES_SCHEMA
from reproduction.design.label_sets import LabelSet
from reproduction.design.shapes import SHAPES, largest_in_all_shapes
from reproduction.design.shapes import TABLE as SHAPES_ROWS
from reproduction.report.intervals import Interval, cell_interval, change_text, percent
from reproduction.report.published import read_table
from reproduction.tables.layouts import TITLES
from reproduction.tables.references import SCHEMA as REFERENCES
from reproduction.tables.references import two_digits
from synfeal.records.tables import read_frame, rows_of

ROOM, SMALL = "large_room", "6k"
POSITION, ORIENTATION = "position_m_true", "orientation_deg_true"
# What feature matching does without depth: points are where rays of two training frames meet.
WITHOUT_DEPTH, ADJUSTED = "structure-rays", "structure-adjusted"


class Finding(NamedTuple):
    """One finding: a sentence to remember, what it rests on, and where to look it up.

    Attributes:
        headline: The sentence.
        evidence: Its numbers with their limits.
        against: What errors are measured against.
        source: Table that has the numbers.
        short: The sentence with one number, for those who read no more.
    """

    headline: str
    evidence: str
    against: str
    source: Path
    short: str


def can_tell(root: Path) -> bool:
    """Check that a run has the rows that its findings rest on, with scores and limits.

    A handful of test paths gives no limits, and then nothing is told.
    """
    if not all((root / "tables" / f"{name}.csv").is_file() for name in NEEDED):
        return False
    tables = [read_table(root, name) for name in NEEDED if name.startswith("table")]
    if any(table[[POSITION, ORIENTATION]].isna().to_numpy().any() for table in tables):
        return False
    noisy = read_table(root, "table3_inconsistencies").query("block == 'both' and noise_m > 0")
    if not (len(localizers(root)) and len(noisy)):
        return False
    compared = [row for row in (reference(root, WITHOUT_DEPTH), best(localizers(root))) if row]
    limits = [cell_interval(row, POSITION) for row in compared]
    return all(math.isfinite(number) for interval in limits for number in interval)


def findings(root: Path) -> list[Finding]:
    """List what a run found beyond the claims, most important first.

    Args:
        root: Results.
    """
    found = (finding(root) for finding in OF_RUN)
    return [finding for finding in found if finding is not None]


def localizers(root: Path, noise: tuple[float, float] = (0.0, 0.0)) -> pd.DataFrame:
    """Select the localizers on the small Large Room set, without or with noise in their labels."""
    if noise == (0.0, 0.0):
        cells = read_table(root, "table4_size")
        return cells[(cells.scene == ROOM) & (cells["size"] == SMALL)]
    cells = read_table(root, "table3_inconsistencies")
    chosen = (cells.noise_m == noise[0]) & (cells.noise_deg == noise[1])
    return cells[chosen & (cells.block == "both")]


def reference(root: Path, method: str, noise: tuple[float, float] = (0.0, 0.0)) -> Any | None:
    """Select a reference method on the same frames as :func:`localizers`.

    Args:
        root: Published results, or those of a finished run.
        method: Name of the method.
        noise: Position noise, metres, and orientation noise, degrees, of the labels.

    Returns:
        The method's row; None where it was not run or has no score.
    """
    rows = read_table(root, "references", REFERENCES)
    labels = str(LabelSet("noise", *noise)) if any(noise) else SIMULATOR
    chosen = (rows.scene == ROOM) & (rows["size"] == SMALL) & (rows.labels == labels)
    found = rows_of(rows[chosen & (rows.method == method) & rows.position_m_true.notna()])
    return found[0] if found else None


def most_noise(root: Path) -> tuple[float, float]:
    """Return the highest noise in both parts of the labels, metres and degrees, as rows name it."""
    cells = read_table(root, "table3_inconsistencies")
    top = cells[cells.block == "both"].sort_values("noise_m").iloc[-1]
    return float(top.noise_m), float(top.noise_deg)


def moved_by(root: Path) -> tuple[float, float]:
    """Return that noise as labels truly had it, whatever the dose, metres and degrees."""
    noise_m, noise_deg = most_noise(root)
    cells = read_table(root, "table3_inconsistencies")
    moved_m = cells[(cells.block == "both") & (cells.noise_m == noise_m)].moved_m.iloc[0]
    return (noise_m if pd.isna(moved_m) else float(moved_m)), noise_deg


def best(cells: pd.DataFrame) -> Any:
    """Return the localizer with the lowest position error."""
    return rows_of(cells.sort_values(POSITION))[0]


def structure_beats_regression(root: Path) -> Finding | None:
    """Compare feature matching and regression on identical frames with exact labels."""
    matched, network = reference(root, WITHOUT_DEPTH), best(localizers(root))
    if matched is None:
        return None
    pair = [cell_interval(row, POSITION) for row in (matched, network)]
    angles = [cell_interval(row, ORIENTATION) for row in (matched, network)]
    factor = pair[1] / pair[0]
    if factor.low <= 1:
        return None
    return Finding(
        f"On identical frames, matching image features is {_times(factor.value)} times as exact as"
        " regression by these small networks.",
        f"From {network.n_train:,} training frames with exact poses and no depth, matched features"
        f" locate test frames with a median error of {_cm(pair[0])} and {_deg(angles[0])}. The best"
        f" of the five networks, {TITLES[network.model]}, is off by {_cm(pair[1])} and"
        f" {_deg(angles[1])}.",
        "labels and truth alike, because these labels are exact",
        root / "tables" / "references.csv",
        f"From the same {network.n_train:,} frames, matched image features locate test frames to"
        f" {_short_cm(pair[0])}, the best of five small networks to {_short_cm(pair[1])}.",
    )


def a_map_beats_exact_labels(root: Path) -> Finding | None:
    """Compare a bundle-adjusted map from noisy labels with regression on exact ones."""
    noise = most_noise(root)
    adjusted, network = reference(root, ADJUSTED, noise), best(localizers(root))
    if adjusted is None:
        return None
    ours, theirs = (
        [cell_interval(row, measure) for measure in (POSITION, ORIENTATION)]
        for row in (adjusted, network)
    )
    if not (ours[0].high < theirs[0].low and ours[1].high < theirs[1].low):
        return None
    return Finding(
        "A map made from badly wrong poses beats regression trained on exact ones.",
        f"The labels are {_noise(moved_by(root))} off. Bundle adjustment moves the poses until the"
        f" images agree, and the resulting map locates test frames with a median error of"
        f" {_cm(ours[0])} and {_deg(ours[1])}. The best network, trained on exact labels, is off by"
        f" {_cm(theirs[0])} and {_deg(theirs[1])}.",
        "the truth",
        root / "tables" / "references.csv",
        f"Labels {_noise(moved_by(root))} off, mended by bundle adjustment, make a map of matched"
        f" features that locates to {_short_cm(ours[0])}; the best network, trained on exact"
        f" labels, locates to {_short_cm(theirs[0])}.",
    )


def shape_changes(root: Path) -> dict[str, tuple[Interval, Interval]]:
    """Return how each shape of label errors changes both errors against the truth.

    Returns:
        Factors by shape; nothing where the run has not compared them.
    """
    path = _shape_changes_file(root)
    if not path.is_file():
        return {}
    factors = {
        (row.change, row.error): Interval(
            *(1 + percent / 100 for percent in (row.percent, row.percent_low, row.percent_high))
        )
        for row in rows_of(read_frame(path, SHAPES_SCHEMA, "publish again"))
    }
    return {shape: (factors[shape, "position"], factors[shape, "orientation"]) for shape in SHAPES}


def _shape_changes_file(root: Path) -> Path:
    return root / "tables" / f"{SHAPE_CHANGES}.csv"


def largest_label_errors(root: Path) -> pd.DataFrame:
    """Select the rows of the largest label errors that Table 6 has in all shapes."""
    cells = read_table(root, SHAPES_ROWS)
    wrong = cells[cells.labels.isin([*SHAPES])]
    sizes = zip(wrong.labels, wrong.noise_m, wrong.noise_deg, strict=True)
    noise_m, noise_deg = largest_in_all_shapes(sizes) or (math.nan, math.nan)
    return wrong[(wrong.noise_m == noise_m) & (wrong.noise_deg == noise_deg)]


def off_in_all_shapes(root: Path) -> tuple[float, float]:
    """Return how far off these labels are, metres and degrees; NaN where there are none."""
    rows = largest_label_errors(root)
    if rows.empty:
        return math.nan, math.nan
    row = rows.iloc[0]
    return float(row.noise_m if pd.isna(row.moved_m) else row.moved_m), float(row.noise_deg)


def shared_errors_stay(root: Path) -> Finding | None:
    """Compare label errors that are independent with those that frames share."""
    changes = shape_changes(root)
    if len(changes) < len(SHAPES):
        return None
    own, path, space = (changes[shape][1] for shape in SHAPES)
    if not space.low > own.high:  # nor where too few test paths leave no limits
        return None
    headline = (
        "Label errors that differ from frame to frame mostly average out; those that frames share"
        " do not."
        if path.low > own.high
        else "Label errors that bend space do more harm than errors that differ by frame."
    )
    parts = [f"{percent(changes[shape][1])} if {text}" for shape, text in SHAPES.items()]
    return Finding(
        headline,
        f"Labels that are {_noise(off_in_all_shapes(root))} off change the orientation error,"
        f" averaged over"
        f" the five networks, by {', '.join(parts[:-1])}, and {parts[-1]}.",
        "the truth",
        _shape_changes_file(root),
        f"Labels {_noise(off_in_all_shapes(root))} off change the networks' orientation error"
        f" against the true poses by {change_text(own.value)} if every frame has an error of its"
        f" own, by {change_text(space.value)} if one smooth distortion of space moves them all.",
    )


# Tables that the findings of a run rest on.
NEEDED = ("table3_inconsistencies", "table4_size", SHAPES_ROWS, "references")
OF_RUN: Sequence[Callable[[Path], Finding | None]] = (
    structure_beats_regression,
    a_map_beats_exact_labels,
    shared_errors_stay,
)


def sentences(found: Sequence[Finding], top: str) -> list[str]:
    """List findings as Markdown, with their evidence.

    Args:
        found: The findings.
        top: Path from the page to the top of the repository, ending in a slash.
    """
    return [
        f"**{one.headline}** {one.evidence} *Measured against {one.against}.*"
        f" ([table]({top}{one.source.as_posix()}))"
        for one in found
    ]


def short_sentences(found: Sequence[Finding]) -> list[str]:
    """List findings as Markdown, one sentence and the table each, for a page at the top."""
    return [f"{one.short} ([table]({one.source.as_posix()}))" for one in found]


def _cm(interval: Interval) -> str:
    value, low, high = (two_digits(100 * end) for end in interval)
    return f"{value} cm ({low} – {high})"


def _short_cm(interval: Interval) -> str:
    return f"{two_digits(100 * interval.value)} cm"


def _deg(interval: Interval) -> str:
    value, low, high = (two_digits(end) for end in interval)
    return f"{value}° ({low} – {high})"


def _times(factor: float) -> str:
    return f"{round(factor, -1 if factor >= 100 else 0):.0f}"


def _noise(noise: tuple[float, float]) -> str:
    return f"{100 * noise[0]:.0f} cm and {noise[1]:.0f}°"
