"""Tell which verdicts of single runs the pooled replications changed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from reproduction.claims.tables import ClaimTables, has_claims, read_claims
from reproduction.claims.verdicts import published_claims
from reproduction.report.claim_lines import verdicts_of
from reproduction.runs.published import REPLICATIONS, SINGLE_RUNS
from reproduction.tables.sheet import markdown_table

HEADING = (
    "## What replications changed\n\nVerdicts of single runs, each told by the run that decided:"
)


def changes_since_single_runs(published: Path) -> str:
    """Tabulate the verdicts of single runs beside those of pooled replications, under a heading.

    Args:
        published: Folder of published results.

    Returns:
        Nothing where replications are not pooled yet.
    """
    if not has_claims(published / REPLICATIONS):
        return ""
    before, after = (read_claims(published / name) for name in (SINGLE_RUNS, REPLICATIONS))
    rows = [_row(claim.id, before, after) for claim in published_claims()]
    return f"{HEADING}\n\n{markdown_table(pd.DataFrame(rows))}"


def _row(claim: str, before: ClaimTables, after: ClaimTables) -> dict[str, str]:
    old, new = verdicts_of(claim, before), verdicts_of(claim, after)
    return {
        "": claim,
        "single runs": old,
        "replications, pooled": new,
        "changed": "yes" if old != new else "",
    }
