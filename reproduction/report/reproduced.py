"""Five lines that the read-me opens with: what of the paper was reproduced, and what was not."""

from __future__ import annotations

import re
from pathlib import Path
from statistics import mean
from typing import Literal, NamedTuple

from reproduction.claims.evidence import QUANTITIES
from reproduction.report.findings import (
    CONTROLS,
    LABELS,
    paired_changes,
    read_table,
    sfm_training_labels,
)
from reproduction.report.intervals import Interval, change_text, percent, signed
from reproduction.report.paper_cells import SIZES, paper_cells, rank_correlations
from reproduction.report.published_claims import read_published
from synfeal.errors import InputError

CHANGES = re.compile(r"p ([+-]?\d+) %, o ([+-]?\d+) %")
# Lines are told by published runs with fresh seeds whose test frames are whole paths: by this one,
# and by those of the findings on sizes and on labels.
MORE_SANCTUARY = "more_sanctuary"
# Claims whose changes, like the paper's, are shares of the error with noise, so that none is over
# 100 %. Here they are told over the error without.
SHARES_OF_THE_LARGER = ("C6",)


class Effect(NamedTuple):
    """Changes of both errors that a claim is about.

    Attributes:
        name: What is compared.
        run: Published run that they are of.
        claim: Id of the claim.
        against: What errors are measured against: ``true`` poses or the ``labels`` of the test set.
        ours: Factors on the position and the orientation error, with limits.
        paper: The same in the paper, without limits; None where it has no such number.
    """

    name: str
    run: str
    claim: str
    against: Literal["labels", "true"]
    ours: tuple[Interval, Interval]
    paper: tuple[float, float] | None

    def __str__(self) -> str:
        """Format both changes with limits, and the paper's."""
        paper = f" (paper: {', '.join(map(change_text, self.paper))})" if self.paper else ""
        return (
            f"{percent(self.ours[0])} in position and {percent(self.ours[1])} in orientation{paper}"
        )


def effects(root: Path) -> list[Effect]:
    """List the changes that claims are about, with the paper's, from published runs.

    Args:
        root: One of the published runs.

    Raises:
        InputError: A run that one is told by is not published, or does not judge the claim.
    """
    room = _effect("Large Room, 6k to 80k frames, mean of five networks", root, CONTROLS, "C7")
    sanctuary = _effect(
        "Sanctuary, 6k to 95k frames, mean of five networks", root, MORE_SANCTUARY, "C8"
    )
    noise = _effect(
        "noise of 0.30 m and 20° in all labels, PoseNet2", root, LABELS, "C6", against="labels"
    )
    # The paper has no score of noisy labels against true poses.
    harm = _effect("the same, against the true poses", root, LABELS, "C6")._replace(paper=None)
    labels = _effect("simulator's labels instead of SfM's, PoseNet2", root, LABELS, "C2")
    return [room, sanctuary, noise, harm, labels]


def reproduced(root: Path) -> str:
    """Tell in a line each what was reproduced, most important first.

    Args:
        root: Published results whose Table 4 is compared, among other published ones.

    Raises:
        InputError: The run has no Table 4, or another that a line is told by is not published.
    """
    if not (root / "tables" / f"{SIZES}.csv").is_file():
        raise InputError(root, "has no Table 4", "publish again")
    room, sanctuary, noise, harm, labels = effects(root)
    lines = (
        _size(room, sanctuary),
        _noise(noise, harm),
        _networks(root),
        _labels(root, labels),
        _start(root),
    )
    return "\n".join(f"- {line}" for line in lines)


def _size(room: Effect, sanctuary: Effect) -> str:
    return (
        "**Reproduced: more frames, smaller errors.** Mean of the five networks: Large Room, 6k to"
        f" 80k frames, {room}; Sanctuary, 6k to 95k, {sanctuary}."
    )


def _noise(seen: Effect, harm: Effect) -> str:
    return (
        "**In part: noisy labels do harm, but less.** 0.30 m and 20° of noise, PoseNet2, scored"
        f" against equally noisy test labels as in the paper: {seen}. Against the true poses:"
        f" {harm}."
    )


def _networks(root: Path) -> str:
    cells = paper_cells(root)
    position, orientation = (rank_correlations(cells, quantity, "row") for quantity in QUANTITIES)
    against = sum(order < 0 for order in position)
    return (
        "**Not reproduced: which network is best.** Rank correlation with the paper among the five,"
        f" mean over the {len(position)} rows of Table 4: {signed(mean(position))} in position"
        f" (negative in {against} rows), {signed(mean(orientation))} in orientation."
        " Our networks are small and shown little."
    )


def _labels(root: Path, effect: Effect) -> str:
    found = sfm_training_labels(root.with_name(LABELS))
    if found is None:
        raise InputError(root.with_name(LABELS), "has no labels of SfM", "publish again")
    cells = read_table(root.with_name(LABELS), "table2_ground_truth")
    (network,) = cells[(cells.model == "posenet2") & (cells.labels == "sfm")].position_m_true
    return (
        "**Not seen: better labels, better networks.** The simulator's labels instead of SfM's"
        f" change PoseNet2's errors by {effect}. Our SfM's labels are off by"
        f" {100 * found[1].position_m_median:.1f} cm in the median, PoseNet2 by"
        f" {100 * network:.0f} cm: there is little to gain."
    )


def _start(root: Path) -> str:
    row = _claim(root.with_name(CONTROLS), "C10")
    texts = []
    for size in ("6k", "20k"):
        limits = rf"{size}: p ([+-][\d.]+) % to ([+-][\d.]+) %"
        if found := re.search(limits, row["interval_true"]):
            low, high = (change_text(1 + float(end) / 100) for end in found.groups())
            texts.append(f"{low} to {high} at {size}")
    return (
        f"**Undecided: transfer learning.** {row['measured_true'].capitalize()} at 6k and 20k"
        " frames, both errors of five networks (paper: 20 of 20); a start from scratch changes the"
        f" position error, mean of the five, by {', '.join(texts)}."
    )


def _effect(
    name: str, root: Path, profile: str, claim: str, against: Literal["labels", "true"] = "true"
) -> Effect:
    run = root.with_name(profile)
    ours = paired_changes(run, claim, score=against)
    found = CHANGES.search(_claim(run, claim)["published"])
    if ours is None or found is None:
        raise InputError(run, f"does not judge {claim}", "publish again")
    position, orientation = (1 + int(text) / 100 for text in found.groups())
    if claim in SHARES_OF_THE_LARGER:
        ours = over_smaller(ours[0]), over_smaller(ours[1])
        position, orientation = 1 / (2 - position), 1 / (2 - orientation)
    return Effect(name, profile, claim, against, ours, (position, orientation))


def over_smaller(share: Interval) -> Interval:
    """Convert a change that is told as a share of the larger error to one over the smaller.

    Args:
        share: One plus the share, with limits.
    """
    return Interval(*(1 / (2 - end) for end in share))


def _claim(run: Path, claim: str) -> dict[str, str]:
    rows = {row["id"]: row for row in read_published(run)}
    if claim not in rows:
        raise InputError(run, f"does not judge {claim}", "publish again")
    return rows[claim]
