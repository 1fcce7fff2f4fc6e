"""``claim_effects.csv`` and ``claims.csv``: effects as numbers, and the verdict on each claim.

A run writes both of itself, and pooled replications write both of all. Everything that is said
about claims, in reports and on pages, is rendered from these two tables.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from reproduction.claims.effects import BEST_NETWORK, DESCRIBED, Against
from reproduction.claims.judge import BEST
from reproduction.claims.verdicts import Verdict
from synfeal.errors import InputError
from synfeal.records.tables import (
    COUNT,
    LIMITLESS_MAYBE,
    MAYBE,
    MAYBE_TEXT,
    TEXT,
    Kind,
    read_frame,
    write_frame,
)

EFFECTS, CLAIMS = "claim_effects.csv", "claims.csv"
# Values of the column ``replication`` in rows that decide: of a single run, and of several.
THIS_RUN, POOLED = "this run", "pooled"
# Empty of batches and of speeds, which no test labels are needed for.
AGAINST = Kind("str", optional=True)
EFFECTS_SCHEMA = {
    "claim": TEXT,
    "part": TEXT,
    "quantity": TEXT,
    "against": AGAINST,
    "replication": TEXT,
    "value": LIMITLESS_MAYBE,  # none where learning curves do not fall
    "low": LIMITLESS_MAYBE,
    "high": LIMITLESS_MAYBE,
    "printed": MAYBE,
    "standard_error": MAYBE,
    "unit": TEXT,
}
CLAIMS_SCHEMA = {
    "claim": TEXT,
    "against": AGAINST,
    "verdict": TEXT,
    "replications": COUNT,
    "reason": MAYBE_TEXT,
}
PERCENT, SHARE, RATE = "percent", "share", "frames/s"
# Parts that are shown the other way round than they are judged, as the harm of what is there.
SHOWN = {"no noise, not the most": "the most noise, not none"}
REMEDY = "make the claims again"
Row = Mapping[str, object]
Keys = tuple[str, str]  # claim and what errors are against


class Part(NamedTuple):
    """A part of a claim, as it is shown.

    Attributes:
        claim: Id of the claim.
        label: What is compared, and in which quantity.
        quantity: Position or orientation, or what else is compared.
        unit: ``percent`` (a change), ``share`` of batches, or ``frames/s``.
        single: Values of the replications; empty for a single run.
        decided: The value that decides, and its limits.
        printed: The paper's; NaN where it has no such number.
    """

    claim: str
    label: str
    quantity: str
    unit: str
    single: tuple[float, ...]
    decided: tuple[float, float, float]
    printed: float


class ClaimTables(NamedTuple):
    """Effects that the claims assert, and verdicts on them.

    Attributes:
        effects: A row for each effect and replication, and one that decides.
        verdicts: The verdict on each claim by its id and what errors are against.
        reasons: Why a claim has no better verdict, by the same keys; empty where limits say it.
    """

    effects: pd.DataFrame
    verdicts: dict[Keys, Verdict]
    reasons: dict[Keys, str]

    def verdict(self, claim: str, against: Against) -> tuple[Verdict, str] | None:
        """Return a claim's verdict and its reason; None where it was not judged."""
        for key in ((claim, against), (claim, "true"), (claim, "")):
            if key in self.verdicts:
                return self.verdicts[key], self.reasons[key]
        return None


def has_claims(folder: Path) -> bool:
    """Tell whether a folder has both tables."""
    return all((folder / name).is_file() for name in (EFFECTS, CLAIMS))


def read_claims(folder: Path) -> ClaimTables:
    """Read both tables.

    Raises:
        InputError: One cannot be read, or a verdict is none of those there are.
    """
    path = folder / CLAIMS
    rows = read_frame(path, CLAIMS_SCHEMA, REMEDY)
    for claim, verdict in zip(rows["claim"], rows["verdict"], strict=True):
        if verdict not in [*Verdict]:
            raise InputError(
                f"{path}: claim '{claim}': verdict must be one of {', '.join(Verdict)}"
            )
    keys = list(zip(rows["claim"], rows["against"].fillna(""), strict=True))
    return ClaimTables(
        effects=read_frame(folder / EFFECTS, EFFECTS_SCHEMA, REMEDY),
        verdicts=dict(zip(keys, map(Verdict, rows["verdict"]), strict=True)),
        reasons=dict(zip(keys, rows["reason"].fillna(""), strict=True)),
    )


def write_claims(
    folder: Path,
    effects: Sequence[Row],
    verdicts: Mapping[Keys, Verdict],
    replications: int,
    reasons: Mapping[Keys, str] | None = None,
) -> None:
    """Write both tables.

    Args:
        folder: Where to.
        effects: Rows of ``claim_effects.csv``, by column.
        verdicts: Verdicts by claim and what errors are against.
        replications: How many they rest on.
        reasons: Why they are not other ones, by the same keys.
    """
    write_frame(folder / EFFECTS, pd.DataFrame(effects, columns=list(EFFECTS_SCHEMA)), "%.6g")
    judged = [
        {
            "claim": claim,
            "against": against,
            "verdict": verdict,
            "replications": replications,
            "reason": (reasons or {}).get((claim, against), ""),
        }
        for (claim, against), verdict in sorted(
            verdicts.items(), key=lambda item: (_place(item[0][0]), item[0][1])
        )
    ]
    write_frame(folder / CLAIMS, pd.DataFrame(judged, columns=list(CLAIMS_SCHEMA)))


def _place(claim: str) -> int:
    """Number a claim by its id; what is judged beside the claims comes last."""
    return int(claim[1:]) if claim[1:].isdigit() else 100


def deciding_rows(
    effects: pd.DataFrame, claim: str, part: str, against: Against
) -> dict[str, Mapping[Hashable, Any]]:
    """Select the rows that decide a part of a claim, by quantity.

    Args:
        effects: ``claim_effects.csv``.
        claim: Id of the claim, or what is described beside them.
        part: Part of the claim.
        against: What errors are measured against.
    """
    own = effects[
        (effects["claim"] == claim)
        & (effects["part"] == part)
        & (effects["against"] == against)
        & effects["replication"].isin((THIS_RUN, POOLED))
    ]
    return {row["quantity"]: row for row in own.to_dict("records")}


def parts_in(table: pd.DataFrame, against: Against = "true") -> list[Part]:
    """List the parts of the claims, in the order of the claims.

    Args:
        table: ``claim_effects.csv``.
        against: What errors are measured against, where a claim has both.
    """
    wanted = table[~table["claim"].isin((*DESCRIBED, BEST_NETWORK))]
    both = wanted["claim"].isin(wanted.loc[wanted["against"] == "labels", "claim"])
    wanted = wanted[~both | (wanted["against"] == against)]
    several = _parts(wanted[~wanted["claim"].isin(BEST)])
    nearest = [nearest_rival(wanted, claim) for claim in BEST]
    found = [*several, *(part for part in nearest if part is not None)]
    return sorted(found, key=lambda part: _place(part.claim))


def nearest_rival(effects: pd.DataFrame, claim: str) -> Part | None:
    """Pick the rival that decides: the one that is surest to be better, else the nearest.

    Args:
        effects: ``claim_effects.csv``.
        claim: A claim that one thing is better than each of its rivals.

    Returns:
        None where the claim has no effects.
    """
    rivals = _parts(effects[effects["claim"] == claim])
    better = [part for part in rivals if part.decided[1] > 0]
    end = 1 if better else 2
    return max(better or rivals, key=lambda part: part.decided[end], default=None)


def _parts(effects: pd.DataFrame) -> list[Part]:
    by_part = effects.groupby(["claim", "part", "quantity"], sort=False)
    return [_part(values) for _, values in by_part]


def _part(values: pd.DataFrame) -> Part:
    """Gather a part of a claim from its rows, one of each replication and the one that decides."""
    decides = values["replication"].isin((THIS_RUN, POOLED))
    (row,) = values[decides].to_dict("records")
    name, quantity, unit = (str(row[name]) for name in ("part", "quantity", "unit"))
    shown = SHOWN.get(name, name)
    part = Part(
        claim=str(row["claim"]),
        label=f"{shown}, {quantity}" if unit == PERCENT else shown,
        quantity=quantity,
        unit=unit,
        single=tuple(map(float, values.loc[~decides, "value"])),
        decided=(float(row["value"]), float(row["low"]), float(row["high"])),
        printed=float(row["printed"]),
    )
    return part if shown == name else _turned(part)


def _turned(part: Part) -> Part:
    """Turn changes in percent round: the old value over the new one."""
    value, low, high = part.decided
    return part._replace(
        single=tuple(map(turned_percent, part.single)),
        decided=(turned_percent(value), turned_percent(high), turned_percent(low)),
        printed=turned_percent(part.printed),
    )


def turned_percent(change: float) -> float:
    """Turn a change in percent round: what fell to nothing is infinitely more the other way."""
    factor = 1 + change / 100
    return math.inf if factor == 0 else 100 / factor - 100
