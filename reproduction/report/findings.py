"""Findings of a run in plain words, most important first: each number with its 95 % limits.

Every finding says whether errors are against the labels of the test set, as in the paper, or
against the true poses. A run that lacks the rows of a finding has one finding less.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from baselines.labels.methods import SIMULATOR
from reproduction.claims.label_shapes import NAME as SHAPE_CHANGES
from reproduction.claims.label_shapes import SCHEMA as SHAPES_SCHEMA
from reproduction.claims.rules import frozen_rules
from reproduction.claims.tables import EFFECTS
from reproduction.claims.verdicts import GROUPS
from reproduction.design.label_sets import LabelSet
from reproduction.design.profiles import read_profile
from reproduction.design.shapes import SHAPES, largest_in_all_shapes
from reproduction.design.shapes import TABLE as SHAPES_ROWS
from reproduction.report.fresh import is_fresh
from reproduction.report.intervals import (
    Interval,
    cell_interval,
    change_text,
    mean_change,
    percent,
)
from reproduction.report.publish import PUBLISHED
from reproduction.report.published_claims import (
    counts_now,
    interval_in,
    read_published,
    rules_of,
)
from reproduction.statistics.limits import sign_test
from reproduction.tables.assistance import SCHEMA as ASSISTANCE
from reproduction.tables.cells import schema_of
from reproduction.tables.label_error import SCHEMA as LABEL_ERROR
from reproduction.tables.layouts import TITLES
from reproduction.tables.references import SCHEMA as REFERENCES
from reproduction.tables.references import two_digits
from synfeal.records.tables import Schema, read_frame, rows_of

ROOM, SMALL, LARGE = "large_room", "6k", "80k"
# Runs with fresh seeds that findings are told by, where they are published.
LABELS, CONTROLS, DOSE, BETTER_LABELS = "labels", "controls", "dose", "better_labels"
MEASURES = ("position_m", "orientation_deg")
POSITION, ORIENTATION = "position_m_true", "orientation_deg_true"
# What feature matching does without depth: points are where rays of two training frames meet.
WITHOUT_DEPTH, ADJUSTED = "structure-rays", "structure-adjusted"
# Columns of Table 3, of a row and of the row without noise that it is compared with. The yardstick
# alone is what localizers that learnt from exact labels score against noisy ones.
NOISE_SCORES = {
    "published": ("published_{}", "published_{}"),
    "labels": ("{}", "{}"),
    "yardstick": ("yardstick_{}", "{}_true"),
    "true": ("{}_true", "{}_true"),
}
# Chance, in a sign test, below which so many signs alike are no accident.
SURPRISING = 0.05


class Finding(NamedTuple):
    """One finding: a sentence to remember, what it rests on, and where to look it up.

    Attributes:
        headline: The sentence.
        evidence: Its numbers with their limits.
        against: What errors are measured against.
        table: Table below ``tables``, without suffix.
        short: The sentence with one number, for those who read no more.
        run: Published run that the numbers are of; empty for the one that findings are asked of.
    """

    headline: str
    evidence: str
    against: str
    table: str
    short: str
    run: str = ""


def read_table(root: Path, name: str, schema: Schema | None = None) -> pd.DataFrame:
    """Read a table of published results.

    Args:
        root: Published results, or those of a finished run.
        name: Name of the table, without folder and suffix.
        schema: Columns to read; None for those of a table of localizers.

    Raises:
        InputError: the table is missing or lacks a column.
    """
    kinds = schema or schema_of(name, repeated=True)
    return read_frame(root / "tables" / f"{name}.csv", kinds, "publish again")


def can_tell(root: Path) -> bool:
    """Check that a run has the rows that findings rest on, with scores and limits.

    A handful of test paths gives no limits, and then nothing is told.
    """
    files = [root / "claims.csv", *(root / "tables" / f"{name}.csv" for name in NEEDED)]
    if not all(path.is_file() for path in files):
        return False
    tables = [read_table(root, name) for name in NEEDED if name.startswith("table")]
    if any(table[[POSITION, ORIENTATION]].isna().to_numpy().any() for table in tables):
        return False
    noisy = read_table(root, "table3_inconsistencies").query("block == 'both' and noise_m > 0")
    exact = read_table(root, "table2_ground_truth").query("labels == 'synfeal'")
    if not (len(localizers(root)) and len(noisy) and len(exact)):
        return False
    compared = [row for row in (reference(root, WITHOUT_DEPTH), best(localizers(root))) if row]
    limits = [cell_interval(row, POSITION) for row in compared]
    return all(math.isfinite(number) for interval in limits for number in interval)


def findings(
    root: Path, asked: Sequence[Callable[[Path], Finding | None]] | None = None
) -> list[Finding]:
    """List the findings of published results, or of a finished run, most important first.

    Args:
        root: Results.
        asked: Those that are looked for; None for all.
    """
    found = (finding(root) for finding in (FINDINGS if asked is None else asked))
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
        "references",
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
        "references",
        f"A map that is bundle-adjusted from labels {_noise(moved_by(root))} off locates to"
        f" {_short_cm(ours[0])}; the best network, trained on exact labels, to"
        f" {_short_cm(theirs[0])}.",
    )


def shape_changes(root: Path) -> dict[str, tuple[Interval, Interval]]:
    """Return how each shape of label errors changes both errors against the truth.

    They are compared frame by frame; in runs published before there was a table of it, with the
    limits that Table 6 gives them.
    """
    if _has_by_frame(root):
        return _shapes_by_frame(root)
    cells = read_table(root, SHAPES_ROWS)
    clean, wrong = cells[cells.labels == "synfeal"], largest_label_errors(root)
    changes = {
        shape: _changes(clean, wrong[wrong.labels == shape]) for shape in SHAPES if len(wrong)
    }
    paired = paired_changes(root, "C5", "both")
    return changes | ({"noise": paired} if paired and changes else {})


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


def _has_by_frame(root: Path) -> bool:
    return (root / "tables" / f"{SHAPE_CHANGES}.csv").is_file()


def _shapes_by_frame(root: Path) -> dict[str, tuple[Interval, Interval]]:
    """Read changes that were compared frame by frame, as factors."""
    rows = rows_of(read_table(root, SHAPE_CHANGES, SHAPES_SCHEMA))
    factors = {
        (row.change, row.error): Interval(
            *(1 + percent / 100 for percent in (row.percent, row.percent_low, row.percent_high))
        )
        for row in rows
    }
    return {shape: (factors[shape, "position"], factors[shape, "orientation"]) for shape in SHAPES}


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
        SHAPE_CHANGES if _has_by_frame(root) else SHAPES_ROWS,
        f"Labels {_noise(off_in_all_shapes(root))} off change the networks' orientation error"
        f" against the true poses by {change_text(own.value)} if every frame has an error of its"
        f" own, by {change_text(space.value)} if one smooth distortion of space moves them all.",
    )


def noise_is_mostly_the_yardsticks(root: Path) -> Finding | None:
    """Tell the harm that noise does to localizers from what it does to the labels they meet."""
    asked, root = root, fresh_run(root, DOSE)
    noise_m, noise_deg = most_noise(root)
    changes = noise_changes(root)
    most = changes[(changes.noise_m == noise_m) & (changes.noise_deg == noise_deg)]
    top = rows_of(most[most.block == "both"])[0]
    seen = paired_changes(root, "C5", "both", "labels")
    harm = paired_changes(root, "C5", "both")
    if seen is None or harm is None:
        return None
    alone, printed = (
        [getattr(top, f"{score}_{measure}") for measure in MEASURES]
        for score in ("yardstick", "published")
    )
    # Written so that a run without the yardstick's columns has no finding either.
    if not all(own - 1 >= (all_of.value - 1) / 2 for own, all_of in zip(alone, seen, strict=True)):
        return None
    return Finding(
        "Most of what noise in the labels seems to do is done by the noise of the test labels.",
        f"Labels that are {_noise(moved_by(root))} off change the errors against test labels with"
        f" the same noise, averaged over the five networks, by {percent(seen[0])} and"
        f" {percent(seen[1])} (in the paper: {' and '.join(map(change_text, printed))}). Scored"
        f" against such labels, networks that learnt from exact ones seem worse, too, by"
        f" {' and '.join(map(change_text, alone))}. Against the true poses the changes are"
        f" {percent(harm[0])} and {percent(harm[1])}.",
        "labels or truth, as each sentence says",
        "table3_inconsistencies",
        f"Noise in all labels changes the networks' orientation error by"
        f" {change_text(seen[1].value)} against the noisy test labels and by"
        f" {change_text(harm[1].value)} against the true poses: most of it is in the test labels.",
        _told_by(root, asked),
    )


def noise_changes(root: Path) -> pd.DataFrame:
    """Compute how noise changes the errors of Table 3, means over the localizers.

    Returns:
        A row per block and level of noise, in the order of the table: ``block``, ``noise_m``,
        ``moved_m``, ``noise_deg``, and factors on the errors without noise,
        ``<score>_<measure>`` with the scores of :data:`NOISE_SCORES`. Misprints do not count.
    """
    cells = read_table(root, "table3_inconsistencies")
    printed = [f"published_{measure}" for measure in MEASURES]
    cells.loc[cells.published_flag != "none", printed] = math.nan
    is_exact = (cells.noise_m == 0) & (cells.noise_deg == 0)
    pairs = cells[~is_exact].merge(
        cells[is_exact], on=["block", "model"], suffixes=("", "_exact"), validate="m:1"
    )
    levels = ["block", "noise_m", "moved_m", "noise_deg"]
    factors = pairs[levels].assign(
        **{
            f"{score}_{measure}": pairs[own.format(measure)] / pairs[f"{of.format(measure)}_exact"]
            for score, (own, of) in NOISE_SCORES.items()
            for measure in MEASURES
        }
    )
    return factors.groupby(levels, sort=False, dropna=False).mean().reset_index()


def half_the_images(root: Path) -> tuple[Interval, Interval, float, float]:
    """Compare twice the images alone, at the small size, with the size's whole effect.

    Shares are of logarithms, in which effects that follow one another add up.
    """
    shown = read_table(root, "table7_images_shown")
    half, whole = (shown[shown.init == init] for init in ("pretrained-half", "pretrained"))
    size = sizes_of_room(root)
    images, frames = _changes(half, whole), _changes(size[SMALL], size[LARGE])
    shares = [math.log(i.value) / math.log(f.value) for i, f in zip(images, frames, strict=True)]
    return *images, shares[0], shares[1]


def more_frames_help(root: Path) -> Finding | None:
    """Compare sizes of the data set, with the part of the effect that is longer training."""
    controls = fresh_run(root, CONTROLS)
    if controls != root:
        return frames_and_images(root, controls)
    size = sizes_of_room(root)
    if not {SMALL, LARGE} <= {*size}:
        return None
    few, many = size[SMALL], size[LARGE]
    position, orientation = paired_changes(root, "C7") or _changes(few, many)
    if max(position.high, orientation.high) >= 1:
        return None
    images_m, images_deg, *shares = half_the_images(root)
    low, high = sorted(round(100 * share) for share in shares)
    return Finding(
        "More frames help, and part of that is longer training.",
        f"From {SMALL} to {LARGE} frames of the Large Room the position error changes by"
        f" {percent(position)} and the orientation error by {percent(orientation)}"
        f" {_printed(few, many)}. But runs on larger sets are also shown more images, and doubling"
        f" the images alone changes the errors at {SMALL} by {change_text(images_m.value)} and"
        f" {change_text(images_deg.value)}, which is {low} to {high} % of the effect of size. No"
        f" {SMALL} run was shown as many images as the {LARGE} runs.",
        "labels and truth alike",
        "table4_size",
        f"From {SMALL} to {LARGE} frames the position error changes by"
        f" {change_text(position.value)}, part of it by longer training.",
    )


def frames_and_images(root: Path, controls: Path) -> Finding | None:
    """Tell what more frames are worth from what more images are, by two runs.

    Args:
        root: Published results whose largest set was shown as many images as the smallest set of
            ``controls``.
        controls: Published results of a run that shows more images at every size.
    """
    size, size_before = sizes_of_room(controls), sizes_of_room(root)
    shown, shown_before = (images_shown(one.name) for one in (controls, root))
    if shown[SMALL] != shown_before[LARGE]:
        return None
    few, many = size[SMALL], size[LARGE]
    whole = paired_changes(controls, "C7") or _changes(few, many)
    frames = _changes(few, size_before[LARGE])
    images = _changes(size_before[SMALL], few)
    if max(change.high for change in whole) >= 1:
        return None
    headline = (
        "More frames help, also where no more images are shown."
        if max(change.high for change in frames) < 1
        else "More frames help, together with longer training."
    )
    return Finding(
        headline,
        f"From {SMALL} to {LARGE} frames of the Large Room, shown {shown[SMALL]:,} and"
        f" {shown[LARGE]:,} images, the position error changes by {percent(whole[0])} and the"
        f" orientation error by {percent(whole[1])} {_printed(few, many)}. Frames alone, shown"
        f" {shown[SMALL]:,} images at either size (at {LARGE} in `{root.name}`), change them by"
        f" {percent(frames[0])} and {percent(frames[1])}. Images alone, {shown[SMALL]:,} instead"
        f" of the {shown_before[SMALL]:,} of `{root.name}` at {SMALL}, change them by"
        f" {percent(images[0])} and {percent(images[1])}.",
        "labels and truth alike",
        "table4_size",
        f"From {SMALL} to {LARGE} frames the position error changes by"
        f" {change_text(whole[0].value)}, by {change_text(frames[0].value)} if the larger set is"
        " shown as few images as the smaller.",
        controls.name,
    )


def sizes_of_room(root: Path) -> dict[str, pd.DataFrame]:
    """Return the rows of Table 4 in the Large Room, by size."""
    cells = read_table(root, "table4_size")
    room = cells[cells.scene == ROOM]
    return {str(size): rows for size, rows in room.groupby("size")}


def images_shown(profile: str) -> Mapping[str, int]:
    """Return how many images the runs of a profile are shown, by size."""
    return read_profile(profile).config.training.samples_seen


def _changes(before: pd.DataFrame, after: pd.DataFrame) -> tuple[Interval, Interval]:
    """Compute the factors of both errors between rows of the same localizers."""
    return mean_change(before, after, POSITION), mean_change(before, after, ORIENTATION)


def no_difference_at_this_dose(root: Path) -> Finding | None:
    """Compare labels of SfM and RGB-D SLAM with exact ones, in the run that tests labels."""
    asked, root = root, fresh_run(root, LABELS)
    cells = read_table(root, "table2_ground_truth")
    errors = read_table(root, "label_error", LABEL_ERROR)
    own = errors[
        (errors.scene == ROOM) & (errors.split == "train") & (errors.assistance == "after")
    ]
    own = own.set_index("method")
    exact = cells[cells.labels == "synfeal"]
    names = {"sfm": "SfM", "rgbd-toro": "TORO", "rgbd-g2o": "g2o"}
    if not {*names} <= {*own.index}:
        return None
    doses = [
        f"{title} {100 * own.position_m_median[name]:.1f} cm"
        f" and {own.orientation_deg_median[name]:.1f}°,"
        f" at most {100 * own.position_m_max[name]:.0f} cm and"
        f" {own.orientation_deg_max[name]:.1f}°"
        for name, title in names.items()
    ]
    changes = {
        title: [mean_change(cells[cells.labels == name], exact, m) for m in (POSITION, ORIENTATION)]
        for name, title in names.items()
    }
    single = paired_changes(root, "C2")
    shown = [change for both in (*changes.values(), single or ()) for change in both]
    if single is None or not all(change.holds(1.0) for change in shown):
        return None
    texts = [
        f"{' and '.join(change_text(change.value) for change in both)} ({title})"
        for title, both in changes.items()
    ]
    sfm = cells[cells.labels == "sfm"]
    pairs = sfm.merge(exact, on="model", suffixes=("_sfm", "_exact"), validate="1:1")
    gains = [pairs[f"{m}_exact"] / pairs[f"{m}_sfm"] - 1 for m in (POSITION, ORIENTATION)]
    lower, counted, chance = sign_test([float(gain) for both in gains for gain in both])
    likely = ", so a small gain is likely" if lower > counted / 2 and chance < SURPRISING else ""
    posenet2 = (rows[rows.model == "posenet2"] for rows in (sfm, exact))
    errors_m = 100 * exact[POSITION]
    largest = max(abs(100 * (one.value - 1)) for both in changes.values() for one in both)
    failing = where_labels_fail(fresh_run(asked, BETTER_LABELS))
    return Finding(
        "Exact labels in place of those of SfM and RGB-D SLAM: a difference can be seen only where"
        " SfM fails badly in places."
        if failing
        else "Exact labels in place of those of SfM and RGB-D SLAM: the difference is too small to"
        " see.",
        f"The estimated labels are off by little in the median ({'; '.join(doses)}), the networks"
        f" by {errors_m.min():.0f} to {errors_m.max():.0f} cm, so these label errors can do little."
        f" Exact labels change the position and orientation errors, averaged over"
        f" the five networks, by {', '.join(texts)}. With exact labels instead of SfM's, {lower} of"
        f" {counted} errors are lower{likely}; those of PoseNet2 change by {percent(single[0])}"
        f" and {percent(single[1])} {_printed(*posenet2)}.{failing}",
        "the truth",
        "table2_ground_truth",
        "Labels that SfM and RGB-D SLAM find in these renderings are"
        f" {_ends(100 * own.position_m_median[[*names]])} cm off in the median, the networks"
        f" {_ends(errors_m, 0)} cm: exact labels change the networks' mean errors by"
        f" {largest:.0f} % at most.",
        _told_by(root, asked),
    )


def where_labels_fail(root: Path) -> str:
    """Say what exact labels change in a run some of whose SfM batches needed assistance.

    Returns:
        A sentence with a space before it; empty where no batch of the training set needed any, or
        where no change of PoseNet2's errors is certain.
    """
    changes = paired_changes(root, "C2")
    if changes is None or not any(change.high < 1 for change in changes):
        return ""
    found = sfm_training_labels(root)
    if found is None:
        return ""
    batches, labels = found
    if not batches.assisted:
        return ""
    return (
        f" In `{root.name}`, where SfM's labels are off by {100 * labels.position_m_median:.1f} cm"
        f" in the median, too, but {batches.assisted} of {batches.batches} training batches needed"
        f" assistance (root mean square {100 * labels.position_m_rmse:.0f} cm), exact labels change"
        f" the errors of PoseNet2 by {percent(changes[0])} and {percent(changes[1])}."
    )


def sfm_training_labels(root: Path) -> tuple[Any, Any] | None:
    """Select how SfM fared on the training set of the small Large Room.

    Returns:
        Its rows of ``assistance.csv`` and, after assistance, of ``label_error.csv``; None where the
        run has no such labels.
    """
    found = []
    for name, schema in (("assistance", ASSISTANCE), ("label_error", LABEL_ERROR)):
        rows = read_table(root, name, schema)
        own = (rows.scene == ROOM) & (rows["size"] == SMALL) & (rows.method == "sfm")
        found.append(rows[own & (rows.split == "train")])
    batches, errors = found
    after = errors[errors.assistance == "after"]
    if batches.empty or after.empty:
        return None
    return rows_of(batches)[0], rows_of(after)[0]


def fresh_run(root: Path, profile: str) -> Path:
    """Return the published run of a profile with fresh seeds, or ``root`` if there is none.

    Args:
        root: Published results, or those of a finished run, which are told by themselves.
        profile: Name of the profile.
    """
    other = root.with_name(profile)
    if root.parent.name != PUBLISHED.name or not (other / "claims.csv").is_file():
        return root
    return other if is_fresh(read_published(other)) else root


def _told_by(root: Path, asked: Path) -> str:
    """Name the run that a finding is of; empty where it is the one that was asked."""
    return "" if root == asked else root.name


def paired_changes(
    root: Path, claim: str, part: str = "", score: Literal["labels", "true"] = "true"
) -> tuple[Interval, Interval] | None:
    """Return the changes of both errors on the same test frames, as a claim was judged by them.

    Limits are narrower than those of :func:`mean_change`, for what makes a path hard cancels.

    Args:
        root: Published results, or those of a finished run.
        claim: Id of the claim.
        part: Part of the claim, as ``claims.csv`` names it; empty where it has one alone.
        score: What errors are measured against.

    Returns:
        Factors on the position and the orientation error with their limits; None where the claim
        was not judged.
    """
    if (root / EFFECTS).is_file():
        return None  # judged in numbers, which other lines tell
    rows = read_published(root)
    position, orientation = (interval_in(rows, claim, part, place, score) for place in range(2))
    return (position, orientation) if position and orientation else None


# Tables that the findings rest on.
NEEDED = (
    "table2_ground_truth",
    "table3_inconsistencies",
    "table4_size",
    SHAPES_ROWS,
    "table7_images_shown",
    "references",
    "label_error",
)
# A run on photographs (`real`) has the first finding of all: whether a rendered scan localizes
# photographs. Its function goes to the front of this list.
FINDINGS: Sequence[Callable[[Path], Finding | None]] = (
    structure_beats_regression,
    a_map_beats_exact_labels,
    shared_errors_stay,
    noise_is_mostly_the_yardsticks,
    more_frames_help,
    no_difference_at_this_dose,
)
# Those that rest on tables alone, so that they can be told of a run that is not published, too.
OF_ANY_RUN = FINDINGS[:3]


def sentences(root: Path, link: str = "") -> list[str]:
    """List findings as Markdown, one item each.

    Args:
        root: Published results.
        link: Path from the page to ``root``, for links to tables; empty for no links.
    """
    items = []
    for found in findings(root):
        folder = f"{link.rpartition('/')[0]}/{found.run}" if found.run else link
        where = f" ([table]({folder}/tables/{found.table}.csv))" if link else ""
        seeds = f", with fresh seeds (profile `{found.run}`)" if found.run else ""
        measured = f"*Measured against {found.against}{seeds}.*"
        items.append(f"**{found.headline}** {found.evidence} {measured}{where}")
    return items


def short_sentences(root: Path, link: str) -> list[str]:
    """List findings as Markdown, one sentence and the table each.

    Args:
        root: Published results.
        link: Path from the page to ``root``.
    """
    items = []
    for found in findings(root):
        folder = f"{link.rpartition('/')[0]}/{found.run}" if found.run else link
        items.append(f"{found.short} ([table]({folder}/tables/{found.table}.csv))")
    return items


def verdict_sentence(root: Path) -> str:
    """Say how the paper's claims fared against the truth, group by group."""
    rows = read_published(root)
    groups = counts_now(rows, root)
    parts = []
    for group, title in GROUPS.items():
        verdicts = ", ".join(f"{n} {verdict}" for verdict, n in groups[group].most_common())
        parts.append(f"*{title}* {verdicts}")
    total = sum(sum(counts.values()) for counts in groups.values())
    was_seen = rules_of(rows) != frozen_rules().tag
    run = " in a run that was seen before the rules were frozen" if was_seen else ""
    return f"Of the paper's {total} claims, judged by the true poses{run}: {'; '.join(parts)}."


def _printed(before: pd.DataFrame, after: pd.DataFrame) -> str:
    """Format the paper's changes of both errors, geometric mean over localizers, in brackets."""
    both = before.merge(after, on="model", suffixes=("_old", "_new"), validate="1:1")
    texts = []
    for measure in ("position_m", "orientation_deg"):
        ratio = both[f"published_{measure}_new"] / both[f"published_{measure}_old"]
        texts.append(change_text(float(np.exp(np.log(ratio).mean()))))
    return f"(in the paper: {texts[0]} and {texts[1]})"


def _cm(interval: Interval) -> str:
    value, low, high = (two_digits(100 * end) for end in interval)
    return f"{value} cm ({low} – {high})"


def _short_cm(interval: Interval) -> str:
    return f"{two_digits(100 * interval.value)} cm"


def _ends(values: Collection[float] | pd.Series, digits: int = 1) -> str:
    """Format the lowest and the highest of some numbers."""
    low, high = (f"{end:.{digits}f}".replace("-", "−") for end in (min(values), max(values)))
    return f"{low} to {high}"


def _deg(interval: Interval) -> str:
    value, low, high = (two_digits(end) for end in interval)
    return f"{value}° ({low} – {high})"


def _times(factor: float) -> str:
    return f"{round(factor, -1 if factor >= 100 else 0):.0f}"


def _noise(noise: tuple[float, float]) -> str:
    return f"{100 * noise[0]:.0f} cm and {noise[1]:.0f}°"
