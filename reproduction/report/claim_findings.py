"""Findings that the effects of the claims tell beyond their verdicts, in plain words."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from baselines.labels.methods import SIMULATOR
from reproduction.claims.effects import IMAGES, OWN, RIVALS, Against
from reproduction.claims.evidence import QUANTITIES
from reproduction.claims.levels import LABEL_ERRORS, RMSE, read_cell_errors, read_label_errors
from reproduction.claims.tables import EFFECTS, deciding_rows, read_claims
from reproduction.report.findings import ROOM, SMALL, Finding
from reproduction.report.intervals import Interval, change_text, percent

# Images shown of the largest set of the Large Room over those of the smallest, in the single run
# and in replications (`training.samples_seen`).
TIMES_THE_IMAGES = 2.4
FAR_MORE_EXACT = 5.0


def claim_findings(folder: Path) -> list[Finding]:
    """List what the effects of the claims tell beyond their verdicts.

    Args:
        folder: Effects, verdicts, and errors of cells and of labels.
    """
    found = (finding(folder) for finding in FINDINGS)
    return [finding for finding in found if finding is not None]


def effect_of(
    effects: pd.DataFrame, claim: str, part: str, against: Against = "true"
) -> tuple[Interval, Interval] | None:
    """Return the factors on both errors that decide a part of a claim.

    Args:
        effects: ``claim_effects.csv``.
        claim: Id of the claim, or what is described beside them.
        part: Part of the claim.
        against: What errors are measured against.

    Returns:
        Factors on the position and the orientation error; None where there is no such part.
    """
    rows = deciding_rows(effects, claim, part, against)
    if not {*QUANTITIES} <= {*rows}:
        return None
    position, orientation = (_factor(rows[quantity]) for quantity in QUANTITIES)
    return position, orientation


def _factor(row: Mapping[Hashable, Any]) -> Interval:
    """Convert a change in percent to a factor with its limits."""
    return Interval(*(1 + float(row[end]) / 100 for end in ("value", "low", "high")))


def noise_is_mostly_the_yardsticks(folder: Path) -> Finding | None:
    """Tell the harm that noise does to localizers from what it does to the labels they meet."""
    effects = read_claims(folder).effects
    seen, harm = (effect_of(effects, "C5", "both", against) for against in ("labels", "true"))
    if seen is None or harm is None:
        return None
    # In logarithms, in which effects that follow one another add up; by the far ends of both.
    pairs = zip(seen, harm, strict=True)
    if not all(s.low > 0 and 2 * math.log(h.high) < math.log(s.low) for s, h in pairs):
        return None
    return Finding(
        "Most of what noise in the labels seems to do is done by the noise of the test labels.",
        "Noise of 0.30 m and 20° at the dose of the paper's code changes the errors against test"
        " labels with the same noise, averaged over the five networks, by"
        f" {percent(seen[0])} and {percent(seen[1])}. Against the true poses the changes are"
        f" {percent(harm[0])} and {percent(harm[1])}.",
        "labels or truth, as each sentence says",
        folder / EFFECTS,
        f"Noise in all labels changes the orientation error, mean of the five networks, by"
        f" {change_text(seen[1].value)} against the noisy test labels and by"
        f" {change_text(harm[1].value)} against the true poses: most of it is in the test labels.",
    )


def more_frames_help(folder: Path) -> Finding | None:
    """Tell what more frames do beside what more images alone do."""
    effects = read_claims(folder).effects
    frames = effect_of(effects, "C7", "80k, not 6k")
    images = effect_of(effects, IMAGES, "twice the images")
    if frames is None or images is None:
        return None
    # The larger set is shown more images, too: what these do alone, by the far ends of both.
    pairs = zip(frames, images, strict=True)
    if not all(f.high < _far_low(i) ** math.log2(TIMES_THE_IMAGES) for f, i in pairs):
        return None
    return Finding(
        "More frames help more than showing the same ones again.",
        f"From 6k to 80k frames of the Large Room, shown {TIMES_THE_IMAGES:g} times the images, the"
        f" position error changes by {percent(frames[0])} and the orientation error by"
        f" {percent(frames[1])}."
        f" Twice the images of the same 6k frames change them by {_told(images[0])} and"
        f" {_told(images[1])}.",
        "labels and truth alike",
        folder / EFFECTS,
        f"From 6k to 80k frames, shown {TIMES_THE_IMAGES:g} times the images, the position error"
        f" changes by {change_text(frames[0].value)}; twice the images of the same 6k frames change"
        f" it by {change_text(images[0].value)}.",
    )


def _far_low(change: Interval) -> float:
    """Return the lower limit, or the value where it has none."""
    return change.low if math.isfinite(change.low) else change.value


def label_errors_are_small(folder: Path) -> Finding | None:
    """Put errors of estimated labels beside those of networks, and what exact labels change."""
    effects = read_claims(folder).effects
    changes = [effect_of(effects, "C1", f"exact labels, not {rival}") for rival in RIVALS]
    shown = [change for both in changes if both is not None for change in both]
    if len(shown) < 2 * len(RIVALS):
        return None
    errors = read_label_errors(folder).set_index("method").loc[[*RIVALS]]
    off = errors.position_m
    cells = read_cell_errors(folder)
    exact = cells[
        (cells["scene"] == ROOM)
        & (cells["size"] == SMALL)
        & (cells["labels"] == SIMULATOR)
        & (cells["init"] == "pretrained")
        & (cells["test_set"] == OWN)
        & (cells["against"] == "true")
    ]
    if off.max() * FAR_MORE_EXACT > exact.position_m.min():
        return None
    values = [span.value for span in shown]
    low = change_text(min(span.low for span in shown))
    high = change_text(max(span.high for span in shown))
    off_cm, networks_cm = _ends(100 * off), _ends(100 * exact.position_m, 0)
    texts = [f"{percent(both[0])} and {percent(both[1])}" for both in changes if both is not None]
    return Finding(
        "Labels of SfM and RGB-D SLAM are far more exact here than the networks.",
        "In the median, labels that SfM and RGB-D SLAM give these renderings for training are"
        f" {off_cm} cm off (root mean squares {_ends(100 * errors[RMSE])} cm), the networks"
        f" {networks_cm} cm. Exact labels instead of SfM's, TORO's and g2o's"
        " change the networks' mean position and orientation errors by"
        f" {', '.join(texts[:-1])}, and {texts[-1]}.",
        "the truth",
        folder / LABEL_ERRORS,
        f"Labels that SfM and RGB-D SLAM give these renderings for training are {off_cm} cm off in"
        f" the median, the networks {networks_cm} cm; exact labels instead change the networks'"
        f" mean errors by {change_text(min(values))} to {change_text(max(values))} (95 % limits"
        f" between {low} and {high}).",
    )


FINDINGS: Sequence[Callable[[Path], Finding | None]] = (
    noise_is_mostly_the_yardsticks,
    more_frames_help,
    label_errors_are_small,
)


def _told(change: Interval) -> str:
    """Format a change, with its limits where it has some."""
    return percent(change) if math.isfinite(change.low) else change_text(change.value)


def _ends(values: Collection[float] | pd.Series, digits: int = 1) -> str:
    """Format the lowest and the highest of some numbers."""
    low, high = (f"{end:.{digits}f}".replace("-", "−") for end in (min(values), max(values)))
    return f"{low} to {high}"
