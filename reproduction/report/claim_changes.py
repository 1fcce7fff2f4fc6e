"""Tell which verdicts of single runs the pooled replications changed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from reproduction.claims.tables import ClaimTables, read_claims
from reproduction.claims.verdicts import Verdict, published_claims
from reproduction.report.claim_lines import verdicts_of
from reproduction.runs.published import REPLICATIONS, SINGLE_RUNS
from reproduction.tables.sheet import markdown_table

NOT_FOUND_OUT = {Verdict.NOT_TESTABLE, Verdict.BY_CONSTRUCTION}


def changes_since_single_runs(published: Path) -> str:
    """Tabulate the verdicts of single runs beside those of pooled replications.

    Args:
        published: Folder of published results.
    """
    before, after = (read_claims(published / name) for name in (SINGLE_RUNS, REPLICATIONS))
    rows = [_row(claim.id, before, after) for claim in published_claims()]
    return markdown_table(pd.DataFrame(rows))


def _row(claim: str, before: ClaimTables, after: ClaimTables) -> dict[str, str]:
    old, new = verdicts_of(claim, before), verdicts_of(claim, after)
    change = ""
    if old != new and not {old, new} & NOT_FOUND_OUT:
        was_open, is_open = (Verdict.UNDECIDED in one for one in (old, new))
        change = "decided otherwise"
        if was_open != is_open:
            change = "no longer decided" if is_open else "now decided"
    return {"": claim, "single runs": old, "replications, pooled": new, "change": change}
