"""Sentences and a table told by effects and verdicts; no number in them is written by hand.

They tell a single run, by its own limits, as they tell pooled replications.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import mean
from typing import NamedTuple

import pandas as pd
from scipy.stats import spearmanr

from reproduction.claims.effects import NETWORKS, Against
from reproduction.claims.evidence import QUANTITIES
from reproduction.claims.tables import (
    PERCENT,
    POOLED,
    RATE,
    SHARE,
    THIS_RUN,
    ClaimTables,
    Part,
    parts_in,
)
from reproduction.claims.verdicts import Verdict, published_claims
from reproduction.report.intervals import Interval, change_text, percent, signed
from reproduction.tables.layouts import SOURCES, TITLES, scene_title
from reproduction.tables.sheet import markdown_table

# How a line about claims with a verdict begins.
OUTCOMES = {
    Verdict.HOLDS: "Reproduced",
    Verdict.SMALLER: "Smaller than printed",
    Verdict.LESS: "Smaller than printed",
    Verdict.MIXED: "In part",
    Verdict.NEGLIGIBLE: "Not seen",
    Verdict.OPPOSITE: "Not reproduced",
    Verdict.REFUTED: "Not reproduced",
    Verdict.UNDECIDED: "Undecided",
    Verdict.NOT_LEARNT: "Not learnt at this scale",
}


class Told(NamedTuple):
    """An effect that a line tells.

    Attributes:
        name: What it is a change by.
        claim: Id of the claim that it is of.
        part: Part of the claim.
        against: What errors are measured against, ``true`` poses or ``labels``.
        turned: Whether it is told the other way round than the claim has it.
        in_print: Whether the paper has such a number.
    """

    name: str
    claim: str
    part: str
    against: Against = "true"
    turned: bool = False
    in_print: bool = True


class Topic(NamedTuple):
    """Topic of a line, and the effects that decide it."""

    topic: str
    effects: tuple[Told, ...]


class Line(NamedTuple):
    """A line: the outcome in a few words, and its numbers."""

    outcome: str
    numbers: str


TOPICS = (
    Topic(
        "more frames, smaller errors",
        (
            Told("Large Room, 6k to 80k frames, mean of the five networks", "C7", "80k, not 6k"),
            Told("Sanctuary, 6k to 95k", "C8", "95k, not 6k"),
        ),
    ),
    Topic(
        "noisy labels do harm",
        (
            Told(
                "0.30 m and 20° of noise, PoseNet2, scored against equally noisy test labels",
                "C6",
                "no noise, not the most",
                "labels",
                turned=True,
            ),
            Told(
                "against the true poses",
                "C6",
                "no noise, not the most",
                turned=True,
                in_print=False,
            ),
        ),
    ),
    Topic(
        "better labels, better networks",
        (Told("the simulator's labels instead of SfM's, PoseNet2", "C2", "exact labels, not sfm"),),
    ),
    Topic(
        "transfer learning",
        (
            Told("from scratch, mean of the five networks, 6k", "C10", "from scratch, 6k"),
            Told("20k", "C10", "from scratch, 20k"),
        ),
    ),
)


def claim_lines(tables: ClaimTables) -> list[Line]:
    """Tell in a line each what was reproduced.

    Args:
        tables: Effects and verdicts. What they lack, or could not test, has no line.
    """
    lines = [_line(topic, tables) for topic in TOPICS]
    told = [*lines[:2], _networks(tables.effects), *lines[2:]]
    return [line for line in told if line is not None]


def as_markdown(lines: Sequence[Line]) -> str:
    """Format lines as a list."""
    return "\n".join(f"- **{line.outcome}.** {line.numbers}" for line in lines)


def _line(topic: Topic, tables: ClaimTables) -> Line | None:
    found = [tables.verdicts.get((told.claim, told.against)) for told in topic.effects]
    tested = [
        (told, OUTCOMES[verdict])
        for told, verdict in zip(topic.effects, found, strict=True)
        if verdict in OUTCOMES
    ]
    if not tested:
        return None
    outcome = " / ".join(dict.fromkeys(outcome for _, outcome in tested))
    told = "; ".join(f"{own.name}: {_changes(own, tables.effects)}" for own, _ in tested)
    return Line(f"{outcome}: {topic.topic}", f"{told[0].upper()}{told[1:]}.")


def _changes(told: Told, table: pd.DataFrame) -> str:
    """Format the changes of both errors with limits, and the paper's where it has them."""
    texts, printed = [], []
    for quantity in QUANTITIES:
        own = table[
            (table["claim"] == told.claim)
            & (table["part"] == told.part)
            & (table["quantity"] == quantity)
            & (table["against"] == told.against)
            & table["replication"].isin((THIS_RUN, POOLED))
        ]
        (row,) = own.to_dict("records")
        ends = [1 + float(row[name]) / 100 for name in ("value", "low", "high")]
        factors = [1 / ends[0], 1 / ends[2], 1 / ends[1]] if told.turned else ends
        texts.append(f"{_change(*factors)} in {quantity}")
        if told.in_print and math.isfinite(row["printed"]):
            factor = 1 + float(row["printed"]) / 100
            printed.append(change_text(1 / factor if told.turned else factor))
    paper = f" (paper: {', '.join(printed)})" if printed else ""
    return f"{' and '.join(texts)}{paper}"


def _networks(table: pd.DataFrame) -> Line | None:
    """Tell how the order of the networks agrees with the printed one, by replication."""
    own = table[(table["claim"] == NETWORKS) & (table["replication"] != POOLED)]
    if own.empty or not own["value"].map(math.isfinite).all():
        return None
    parts = []
    for quantity in QUANTITIES:
        rows = own[own["quantity"] == quantity]
        found = [
            float(spearmanr(group["printed"], group["value"])[0])
            for _, group in rows.groupby("replication", sort=False)
        ]
        span = f" ({signed(min(found))} to {signed(max(found))})" if len(found) > 1 else ""
        parts.append(f"{signed(mean(found))} in {quantity}{span}")
    order = own[own["quantity"] == "position"].groupby("part")["value"].mean().sort_values()
    best = TITLES[str(order.index[0])]
    of_several = ", mean and range over the replications" if len(found) > 1 else ""
    return Line(
        "Which network is best",
        f"Rank correlation with the paper among the five{of_several}: {', '.join(parts)}. The"
        f" lowest position error is {best}'s.",
    )


def claims_beside_print(tables: ClaimTables) -> str:
    """Tabulate the claims: what is printed, the effects with limits, and the verdict."""
    parts = parts_in(tables.effects)
    rows = [
        {
            "": claim.id,
            "Claim": claim.statement,
            "Printed": claim.published,
            "Ours (95 % limits)": "; ".join(
                f"{part_label(part)} {part_text(part)}" for part in parts if part.claim == claim.id
            )
            or "–",
            "Verdict": _verdicts(claim.id, tables),
        }
        for claim in published_claims()
    ]
    return markdown_table(pd.DataFrame(rows))


def part_label(part: Part) -> str:
    """Name a part of a claim."""
    if part.unit == RATE:
        return scene_title(part.label)
    if part.unit == SHARE:
        return SOURCES.get(part.label, part.label)
    before, rival, after = part.label.partition(", not ")
    name, comma, quantity = after.partition(",")
    return f"{before}{rival}{SOURCES.get(name, name)}{comma}{quantity}"


def part_text(part: Part) -> str:
    """Format the value of a part with its limits."""
    if part.unit == PERCENT:
        return _change(*(1 + end / 100 for end in part.decided))
    if part.unit == SHARE:
        value, low, high = (100 * end for end in part.decided)
        return f"{value:.0f} % ({low:.0f} to {high:.0f} %)"
    value, low, high = part.decided
    return f"{value:.1f} {part.unit} ({low:.1f} to {high:.1f})"


def _change(value: float, low: float, high: float) -> str:
    """Format a factor with limits as a change in percent; a failed run's is not finite."""
    if not math.isfinite(value):
        return "unknown"
    if math.isfinite(low) and math.isfinite(high):
        return percent(Interval(value, low, high))
    return f"{change_text(value)} (no limits)"


def _verdicts(claim: str, tables: ClaimTables) -> str:
    """Name the verdicts against the labels and against the true poses, or the one they share."""
    keys = [(claim, against) for against in ("labels", "true", "")]
    found = [tables.verdicts[key] for key in keys if key in tables.verdicts]
    return f"**{' / '.join(dict.fromkeys(found))}**" if found else "not judged"
