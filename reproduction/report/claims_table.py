"""One line for each claim of the paper: what is printed, what was found, and the verdict.

Told by the pooled replications once there are any; until then by the runs with fresh seeds, each
claim by the one that decides it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from reproduction.claims.tables import has_claims, read_claims
from reproduction.claims.verdicts import published_claims
from reproduction.replications.pooling import REPLICATIONS
from reproduction.report.claim_lines import claims_beside_print
from reproduction.report.fresh import BESIDE, Judged, claims_to_test, judged_fresh, outcome
from reproduction.report.published_claims import read_published, rows_now
from reproduction.tables.sheet import markdown_table

NOT_RUN = "not judged yet"


def claims_table(root: Path) -> str:
    """Tabulate all claims, in their order.

    Args:
        root: Published results that tell the claims no fresh seed is needed for, among the others.
    """
    replications = root.with_name(REPLICATIONS)
    if has_claims(replications):
        return claims_beside_print(read_claims(replications))
    judged = judged_fresh(root.parent)
    drawn = {claim.id for claim in claims_to_test()}
    built = {row["id"]: row for row in rows_now(read_published(root), root)}
    rows = []
    for claim in published_claims():
        told = {"": claim.id, "Claim": claim.statement, "Printed": claim.published}
        if claim.id in drawn:
            told |= _of_runs(judged.get(claim.id, ()))
        else:
            row = built.get(claim.id, {})
            told |= _cells(row, row.get("verdict_true", NOT_RUN), f"`{root.name}`" if row else "")
        rows.append(told)
    return _with_minus(markdown_table(pd.DataFrame(rows)))


def _of_runs(judged: Sequence[Judged]) -> dict[str, str]:
    """Tell a claim by the run that decides it, else by the first; name those that leave it open."""
    if not judged:
        return _cells({}, NOT_RUN, "")
    deciding = [own for own in judged if own.decided]
    left_open = [own for own in judged if not own.decided]
    told, others = (deciding, left_open) if deciding else (left_open, [])
    runs = _runs(told[:1])
    if len(told) > 1:
        runs += f", also {_runs(told[1:])}"
    if others:
        runs += f"; open in {_runs(others)}"
    return _cells(told[0].row, outcome(judged), runs)


def _runs(judged: Sequence[Judged]) -> str:
    return ", ".join(f"`{own.profile}`" for own in judged)


def _cells(row: Mapping[str, str], verdict: str, runs: str) -> dict[str, str]:
    ours = BESIDE.split(row.get("measured_true", ""))[0]
    if limits := row.get("interval_true"):
        ours += f"; limits: {limits}"
    told = f"**{verdict}** ({runs})" if runs else f"**{verdict}**"
    return {"Ours (95 % limits)": ours, "Verdict (run)": told}


def _with_minus(text: str) -> str:
    """Put a minus sign where a hyphen stands before a digit."""
    return re.sub(r"(?<= )-(?=\d)", "−", text)
