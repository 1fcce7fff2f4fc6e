"""Sentences and tables told by the pooled replications; no number in them is written by hand."""

from __future__ import annotations

import math
from pathlib import Path
from statistics import mean
from typing import NamedTuple

import pandas as pd
from scipy.stats import spearmanr

from reproduction.claims.evidence import QUANTITIES
from reproduction.claims.verdicts import Claim, Verdict, published_claims
from reproduction.replications.effects import NETWORKS
from reproduction.replications.pooling import POOLED
from reproduction.replications.tables import read_pooled
from reproduction.report.findings import change_text, percent, signed
from reproduction.report.forest import Row, rows_in
from reproduction.report.intervals import Interval
from reproduction.tables.layouts import TITLES
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
    against: str = "true"
    turned: bool = False
    in_print: bool = True


class Line(NamedTuple):
    """A line of the read-me: a topic, and the effects that decide it."""

    topic: str
    effects: tuple[Told, ...]


LINES = (
    Line(
        "more frames, smaller errors",
        (
            Told("Large Room, 6k to 80k frames, mean of the five networks", "C7", "80k, not 6k"),
            Told("Sanctuary, 6k to 95k", "C8", "95k, not 6k"),
        ),
    ),
    Line(
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
    Line(
        "better labels, better networks",
        (Told("the simulator's labels instead of SfM's, PoseNet2", "C2", "exact labels, not sfm"),),
    ),
    Line(
        "transfer learning",
        (
            Told("from scratch, mean of the five networks, 6k", "C10", "from scratch, 6k"),
            Told("20k", "C10", "from scratch, 20k"),
        ),
    ),
)


def pooled_lines(folder: Path) -> str:
    """Tell in a line each what was reproduced, by the verdicts on the pooled effects.

    Args:
        folder: Of the pooled tables.

    Raises:
        InputError: A table cannot be read.
    """
    table, verdicts = read_pooled(folder)
    lines = [_line(line, table, verdicts) for line in LINES]
    return "\n".join(f"- {text}" for text in [*lines[:2], _networks(table), *lines[2:]])


def _line(line: Line, table: pd.DataFrame, verdicts: dict[tuple[str, str], str]) -> str:
    found = [verdicts[told.claim, told.against] for told in line.effects]
    outcome = " / ".join(dict.fromkeys(OUTCOMES[Verdict(verdict)] for verdict in found))
    told = "; ".join(f"{own.name}: {_changes(own, table)}" for own in line.effects)
    return f"**{outcome}: {line.topic}.** {told[0].upper()}{told[1:]}."


def _changes(told: Told, table: pd.DataFrame) -> str:
    """Format the changes of both errors with limits, and the paper's where it has them."""
    texts, printed = [], []
    for quantity in QUANTITIES:
        own = table[
            (table["claim"] == told.claim)
            & (table["part"] == told.part)
            & (table["quantity"] == quantity)
            & (table["against"] == told.against)
            & (table["replication"] == POOLED)
        ]
        (row,) = own.to_dict("records")
        ends = [1 + float(row[name]) / 100 for name in ("value", "low", "high")]
        factors = [1 / ends[0], 1 / ends[2], 1 / ends[1]] if told.turned else ends
        texts.append(f"{percent(Interval(*factors))} in {quantity}")
        if told.in_print and math.isfinite(row["printed"]):
            factor = 1 + float(row["printed"]) / 100
            printed.append(change_text(1 / factor if told.turned else factor))
    paper = f" (paper: {', '.join(printed)})" if printed else ""
    return f"{' and '.join(texts)}{paper}"


def _networks(table: pd.DataFrame) -> str:
    """Tell how the order of the networks agrees with the printed one, by replication."""
    own = table[(table["claim"] == NETWORKS) & (table["replication"] != POOLED)]
    parts = []
    for quantity in QUANTITIES:
        rows = own[own["quantity"] == quantity]
        found = [
            float(spearmanr(group["printed"], group["value"])[0])
            for _, group in rows.groupby("replication", sort=False)
        ]
        span = f"{signed(min(found))} to {signed(max(found))}"
        parts.append(f"{signed(mean(found))} in {quantity} ({span})")
    order = own[own["quantity"] == "position"].groupby("part")["value"].mean().sort_values()
    best = TITLES[str(order.index[0])]
    return (
        "**Which network is best.** Rank correlation with the paper among the five, mean and range"
        f" over the replications: {', '.join(parts)}. The lowest position error is {best}'s."
    )


def pooled_claims(folder: Path) -> str:
    """Tabulate the claims: what is printed, the pooled effects with limits, and the verdict.

    Args:
        folder: Of the pooled tables.

    Raises:
        InputError: A table cannot be read.
    """
    table, verdicts = read_pooled(folder)
    parts = [*rows_in(table, "percent"), *rows_in(table, "share")]
    rows = []
    for claim in published_claims():
        own = [row for row in parts if row.claim == claim.id]
        rows.append(
            {
                "": claim.id,
                "Claim": claim.statement,
                "Printed": claim.published,
                "Ours (95 % limits)": "; ".join(map(_part_text, own)) or "–",
                "Verdict": _verdict(claim, verdicts),
            }
        )
    return markdown_table(pd.DataFrame(rows))


def _part_text(row: Row) -> str:
    if row.quantity == "batches assisted":
        value, low, high = (100 * share for share in row.pooled)
        return f"{row.label} {value:.0f} % ({low:.0f} to {high:.0f} %)"
    return f"{row.label} {percent(Interval(*(1 + end / 100 for end in row.pooled)))}"


def _verdict(claim: Claim, verdicts: dict[tuple[str, str], str]) -> str:
    """Name the verdicts against the labels and against the true poses, or the one they share."""
    keys = [(claim.id, against) for against in ("labels", "true", "")]
    found = [verdicts[key] for key in keys if key in verdicts]
    return f"**{' / '.join(dict.fromkeys(found))}**" if found else "not judged"
