"""Sentences and a table told by effects and verdicts; no number in them is written by hand.

They tell a single run, by its own limits, as they tell pooled replications.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from statistics import mean
from typing import NamedTuple

import pandas as pd
from scipy.stats import spearmanr

from reproduction.claims.effects import BEST_NETWORK, NETWORKS, PAPERS_FIVE, Against, Asked
from reproduction.claims.evidence import QUANTITIES
from reproduction.claims.tables import (
    PERCENT,
    POOLED,
    RATE,
    SHARE,
    ClaimTables,
    Part,
    deciding_rows,
    nearest_rival,
    parts_in,
    turned_percent,
)
from reproduction.claims.verdicts import ENOUGH, SMALLEST, Verdict, published_claims
from reproduction.report.intervals import Interval, change_text, percent, signed
from reproduction.tables.layouts import SOURCES, TITLES, scene_title
from reproduction.tables.sheet import markdown_table

# How a line about claims with a verdict begins. What is surely less than printed may be nothing.
REPRODUCED, IN_PART = "Reproduced", "Reproduced in part"
LESS, NOT_SEEN, UNDECIDED = "Smaller than printed", "Not seen", "Undecided"
PERHAPS_NONE = f"{LESS}, if there at all"
OUTCOMES = {
    Verdict.HOLDS: REPRODUCED,
    Verdict.SMALLER: LESS,
    Verdict.LESS: LESS,
    Verdict.MIXED: IN_PART,
    Verdict.NEGLIGIBLE: NOT_SEEN,
    Verdict.OPPOSITE: "Not reproduced",
    Verdict.REFUTED: "Not reproduced",
    Verdict.UNDECIDED: UNDECIDED,
    Verdict.NOT_LEARNT: "Not learnt at this scale",
}


RIVAL = "not "  # stands before what is compared with, in the names of parts


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
    asked: Asked = "size"


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
                "the strongest noise of Table 3, PoseNet2, scored against the true poses",
                "C6",
                "no noise, not the most",
                turned=True,
                in_print=False,
            ),
            Told(
                "scored against equally noisy test labels, as in print",
                "C6",
                "no noise, not the most",
                "labels",
                turned=True,
            ),
        ),
    ),
    Topic(
        "better labels, better networks",
        (
            Told(
                "the simulator's labels instead of SfM's, PoseNet2, scored against the true poses",
                "C2",
                "exact labels, not sfm",
                in_print=False,
            ),
            Told(
                "scored against each method's own test labels, as in print",
                "C2",
                "exact labels, not sfm",
                "labels",
            ),
        ),
    ),
    Topic(
        "transfer learning",
        (
            Told(
                "from scratch instead of pretrained, mean of the five networks, 6k",
                "C10",
                "from scratch, 6k",
            ),
            Told("20k", "C10", "from scratch, 20k"),
        ),
        "direction",
    ),
)


# How large an effect has to be surely, for a claim about it to hold.
ASKED_FOR = {
    "size": "two thirds of the printed size",
    "direction": f"the {SMALLEST:.0f} % asked for",
}
# Claims that the lines are about.
TOLD_CLAIMS = frozenset(told.claim for topic in TOPICS for told in topic.effects)


def claim_lines(tables: ClaimTables) -> list[Line]:
    """Tell in a line each what was reproduced.

    Args:
        tables: Effects and verdicts. What they lack, or could not test, has no line.
    """
    lines = [_line(topic, tables) for topic in TOPICS]
    told = [*lines[:2], _networks(tables), *lines[2:]]
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
    changes = [_decided(own, tables.effects) for own, _ in tested]
    outcomes = [
        PERHAPS_NONE if outcome == LESS and _may_be_none(both) else outcome
        for (_, outcome), both in zip(tested, changes, strict=True)
    ]
    told = "; ".join(
        f"{own.name}{_unless_shared(outcome, outcomes)}: {_changes(own, both)}"
        for (own, _), outcome, both in zip(tested, outcomes, changes, strict=True)
    )
    open_text = ""
    every = [own for both in changes for own in both]
    if {*outcomes} == {UNDECIDED} and all(_is_as_claimed(*own) for own in every):
        less = ""
        if topic.asked == "direction" and all(_is_less(*own) for own in every):
            outcomes = [f"{UNDECIDED}, and {LESS.lower()}"]
            less = f" and by less than {ASKED_FOR['size']}"
        bound = ASKED_FOR[topic.asked]
        open_text = f" All surely in the paper's direction{less}, but not all surely by {bound}."
    text = f"{told[0].upper()}{told[1:]}.{open_text}"
    return Line(f"{_together(outcomes)}: {topic.topic}", text)


def _together(outcomes: Sequence[str]) -> str:
    """Name in a heading what the effects of a topic came to, which may be different things."""
    different = dict.fromkeys(outcomes)
    if len(different) > 1 and REPRODUCED in different:
        return IN_PART
    return LESS if {*different} == {LESS, PERHAPS_NONE} else " / ".join(different)


def _unless_shared(outcome: str, outcomes: Sequence[str]) -> str:
    """Name what one effect came to in brackets, unless all came to the same."""
    return f" ({outcome.lower()})" if len({*outcomes}) > 1 else ""


def _may_be_none(both: Sequence[tuple[Interval, float]]) -> bool:
    return all(span.low <= 1 <= span.high for span, _ in both)


def _is_as_claimed(span: Interval, printed: float) -> bool:
    """Tell whether limits lie on the side of no effect that the printed one is on."""
    return span.low > 1 if printed > 1 else span.high < 1


def _is_less(span: Interval, printed: float) -> bool:
    """Tell whether limits fall short of the share of the printed effect that replicates it."""
    asked = math.pow(printed, ENOUGH)
    return span.high < asked if printed > 1 else span.low > asked


def _decided(told: Told, table: pd.DataFrame) -> list[tuple[Interval, float]]:
    """Return the factors on both errors with limits, and the paper's, which may be no number."""
    rows = deciding_rows(table, told.claim, told.part, told.against)
    found = []
    for quantity in QUANTITIES:
        percents = [float(rows[quantity][name]) for name in ("value", "low", "high", "printed")]
        if told.turned:
            value, low, high, printed = map(turned_percent, percents)
            percents = [value, high, low, printed]
        value, low, high, printed = (1 + number / 100 for number in percents)
        found.append((Interval(value, low, high), printed))
    return found


def _changes(told: Told, both: Sequence[tuple[Interval, float]]) -> str:
    """Format the changes of both errors with limits, and the paper's where it has them."""
    texts = [f"{_change(*own)} in {q}" for q, (own, _) in zip(QUANTITIES, both, strict=True)]
    printed = [change_text(of_paper) for _, of_paper in both if math.isfinite(of_paper)]
    paper = f" (paper: {', '.join(printed)})" if printed and told.in_print else ""
    return f"{' and '.join(texts)}{paper}"


def _networks(tables: ClaimTables) -> Line | None:
    """Tell how the order of the networks agrees with the printed one, by replication."""
    table = tables.effects
    own = table[(table["claim"] == NETWORKS) & (table["replication"] != POOLED)]
    if own.empty:
        return None
    if not own["value"].map(math.isfinite).all():
        return Line(f"{UNDECIDED}: which network is best", "A network that fails leaves it open.")
    parts = []
    for quantity in QUANTITIES:
        rows = own[own["quantity"] == quantity]
        found = [
            float(spearmanr(group["printed"], group["value"])[0])
            for _, group in rows.groupby("replication", sort=False)
        ]
        span = f" ({signed(min(found))} to {signed(max(found))})" if len(found) > 1 else ""
        parts.append(f"{signed(mean(found))} in {quantity}{span}")
    positions = own[own["quantity"] == "position"]
    by_replication = [group.set_index("part") for _, group in positions.groupby("replication")]
    (printed,) = {str(group["printed"].idxmin()) for group in by_replication}
    best = Counter(str(group["value"].idxmin()) for group in by_replication)
    judged = tables.verdict(BEST_NETWORK, "true")
    if judged is None or judged[0] not in OUTCOMES:
        return None
    several = len(found) > 1
    names = ", ".join(
        f"{TITLES[name]}'s{f' in {count} of {len(found)} replications' if several else ''}"
        for name, count in best.most_common()
    )
    over = ", mean and range over the replications" if several else ""
    return Line(
        f"{OUTCOMES[judged[0]]}: which network is best",
        f"The lowest position error is {names}{_beside_the_best(table, printed)} (paper:"
        f" {TITLES[printed]}'s). Rank correlation with the paper among the five{over}:"
        f" {', '.join(parts)}.",
    )


def _beside_the_best(effects: pd.DataFrame, printed: str) -> str:
    """Tell the network that is best in print beside the surest to be better, else the nearest."""
    rival = nearest_rival(effects, BEST_NETWORK)
    if rival is None:
        return ""
    other = TITLES[rival.label.removeprefix(RIVAL).partition(",")[0]]
    return f"; {TITLES[printed]}'s differs from {other}'s by {part_text(rival)}"


def networks_beside_print(effects: pd.DataFrame) -> str:
    """Tabulate the error of each network over the geometric mean of the five, printed and ours.

    Args:
        effects: ``claim_effects.csv``.
    """
    rows = []
    for model in PAPERS_FIVE:
        by_quantity = deciding_rows(effects, NETWORKS, model, "true")
        row: dict[str, str] = {"": TITLES[model]}
        for quantity in QUANTITIES:
            names = ("printed", "value", "low", "high")
            printed, *ours = (1 + float(by_quantity[quantity][name]) / 100 for name in names)
            row[f"{quantity}, printed"] = change_text(printed)
            row[f"{quantity}, ours (95 % limits)"] = _change(*ours)
        rows.append(row)
    return markdown_table(pd.DataFrame(rows))


def claims_beside_print(tables: ClaimTables) -> str:
    """Tabulate the claims: what is printed, the effects with limits, and the verdict."""
    parts = parts_in(tables.effects)
    rows = [
        {
            "": claim.id,
            "Claim": claim.statement,
            "Printed": claim.published,
            "Ours (95 % limits)": _effects([part for part in parts if part.claim == claim.id]),
            "Verdict": _verdict_and_reason(claim.id, tables),
        }
        for claim in published_claims()
    ]
    return markdown_table(pd.DataFrame(rows))


def _effects(parts: Sequence[Part]) -> str:
    """Format the parts of a claim, both errors of one comparison together."""
    by_name: dict[str, list[str]] = {}
    for part in parts:
        name, _, quantity = part_label(part).rpartition(", ")
        if quantity in QUANTITIES:
            by_name.setdefault(name, []).append(f"{quantity} {part_text(part)}")
        else:
            by_name[part_label(part)] = [part_text(part)]
    texts = [f"{name}: {', '.join(texts)}" for name, texts in by_name.items()]
    return "; ".join(texts) or "–"


def part_label(part: Part) -> str:
    """Name a part of a claim."""
    if part.unit == RATE:
        return scene_title(part.label)
    if part.unit == SHARE:
        return SOURCES.get(part.label, part.label)
    if part.label.startswith(RIVAL):  # of the best of all
        model, comma, cell = part.label.removeprefix(RIVAL).partition(",")
        than = "PoseNet2 instead of" if part.claim == BEST_NETWORK else "than"
        return f"{than} {TITLES[model]}{comma}{cell}"
    model, comma, rest = part.label.partition(",")
    if model in TITLES:
        return f"{TITLES[model]}{comma}{rest}"
    new, against, after = part.label.partition(f", {RIVAL}")
    old, comma, quantity = after.partition(",")
    instead = " instead of " if against else ""
    return f"{new}{instead}{SOURCES.get(old, old)}{comma}{quantity}"


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


def verdicts_of(claim: str, tables: ClaimTables) -> str:
    """Name the verdicts against the labels and against the true poses, or the one they share."""
    keys = [key for key in _keys(claim) if key in tables.verdicts]
    return " / ".join(dict.fromkeys(tables.verdicts[key] for key in keys)) or "not judged"


def _verdict_and_reason(claim: str, tables: ClaimTables) -> str:
    reasons = (tables.reasons.get(key, "") for key in _keys(claim))
    said = "; ".join(dict.fromkeys(reason for reason in reasons if reason))
    return f"**{verdicts_of(claim, tables)}**{f' ({said})' if said else ''}"


def _keys(claim: str) -> list[tuple[str, str]]:
    return [(claim, against) for against in ("labels", "true", "")]
