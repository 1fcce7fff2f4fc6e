"""Published verdicts, and the rules they were made by.

The errors of single frames are not tracked, so that verdicts on localizers cannot be judged anew
when the rules change: they stand as they were made. Three can: C4 from the counts of batches, and
C9 and C16, on which the present rules need no numbers.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from reproduction.claims.rules import frozen_rules
from reproduction.claims.table import verdict_counts
from reproduction.claims.untrained import few_verdict
from reproduction.claims.verdicts import GROUPS, MEANINGS, Verdict
from reproduction.replications.tables import REPLICATIONS
from reproduction.report.intervals import Interval
from reproduction.tables.assistance import PUBLISHED_ASSISTED, PUBLISHED_SCENE, TOTAL
from reproduction.tables.assistance import SCHEMA as ASSISTANCE
from synfeal.records.tables import read_frame, read_records, rows_of

# The frozen words for a smaller effect say that it may be none, also where its limits exclude none.
SHOWN_MEANINGS = MEANINGS | {
    Verdict.LESS: "certainly smaller than printed; the limits tell whether there is any"
}
# Of files without a column ``rules``.
BEFORE_FREEZE = "2026-11-22g"
Row = Mapping[str, str]


def published_runs(published: Path) -> list[Path]:
    """List the folders of the published runs that judge claims, by name.

    Replications judge claims together and are no such run.
    """
    folders = (path.parent for path in published.glob("*/claims.csv"))
    return sorted(folder for folder in folders if folder.name != REPLICATIONS)


def read_published(root: Path) -> list[dict[str, str]]:
    """Read the rows of ``claims.csv``, as they were published."""
    path = root / "claims.csv"
    return [row for _, row in read_records(path, ["id", "verdict_true"], "publish again")]


def rules_of(rows: Sequence[Row]) -> str:
    """Return the rules that verdicts were made by."""
    return rows[0].get("rules") or BEFORE_FREEZE


def judged_now(rows: Sequence[Row], root: Path) -> dict[str, Verdict]:
    """Return verdicts, by claim, that present rules change and that tracked tables can tell."""
    if rules_of(rows) == frozen_rules().tag:
        return {}
    published = {row["id"]: row["verdict_true"] for row in rows}
    counts = read_frame(root / "tables" / "assistance.csv", ASSISTANCE)
    own = counts[(counts.scene == PUBLISHED_SCENE) & (counts.split == TOTAL)]
    batches = {
        row.method: (row.assisted, row.batches)
        for row in rows_of(own)
        if row.method in PUBLISHED_ASSISTED
    }
    found = {"C9": Verdict.NOT_TESTABLE}
    if published.get("C16") == Verdict.HOLDS:
        found["C16"] = Verdict.BY_CONSTRUCTION
    if len(batches) == len(PUBLISHED_ASSISTED):
        found["C4"] = few_verdict(batches)
    return {claim: verdict for claim, verdict in found.items() if published.get(claim) != verdict}


def rows_now(rows: Sequence[Row], root: Path) -> list[dict[str, str]]:
    """Replace published verdicts by those of :func:`judged_now`."""
    anew = judged_now(rows, root)
    return [
        {**row, **dict.fromkeys(("verdict_labels", "verdict_true"), str(anew[row["id"]]))}
        if row["id"] in anew
        else dict(row)
        for row in rows
    ]


def counts_now(rows: Sequence[Row], root: Path) -> dict[str, Counter[str]]:
    """Count the claims of each group by verdict against the truth."""
    found = verdict_counts(rows_now(rows, root), "true")
    return {group: found[group] for group in GROUPS}


def rules_note(rows: Sequence[Row], root: Path) -> str:
    """Name the rules that the verdicts of a page were made by."""
    tag = rules_of(rows)
    anew = sorted(judged_now(rows, root), key=lambda claim: int(claim[1:]))
    note = f"Verdicts were made by the rules of {tag}"
    if tag == frozen_rules().tag:
        return f"{note}, with seed {rows[0]['seed']}."
    judged = f", but {', '.join(anew)} by those of {frozen_rules().tag}" if anew else ""
    return (
        f"{note}{judged} ([all rules, dated](rules.md)). They describe runs that were seen before"
        " the rules were frozen; only fresh seeds can test the paper."
    )


def interval_in(
    rows: Sequence[Row],
    claim: str,
    part: str,
    place: int,
    score: Literal["labels", "true"] = "true",
) -> Interval | None:
    """Return a change that a claim was judged by, as a factor; None where it was not.

    Args:
        rows: Rows of ``claims.csv``.
        claim: Id of the claim.
        part: Text before the changes, as in ``both: p ...``; empty where there is none.
        place: 0 for the position, 1 for the orientation.
        score: What errors are measured against.
    """
    found = {row["id"]: row for row in rows}.get(claim)
    if found is None or not found.get(f"interval_{score}"):
        return None
    before = f"{re.escape(part)}: " if part else ""
    measured, interval = found[f"measured_{score}"], found[f"interval_{score}"]
    number = r"([+-][\d.]+) %"
    letter = "po"[place]
    value = re.search(rf"(?:^|; ){before}(?:p [^;(]*?)?\b{letter} {number}", measured)
    ends = re.search(rf"(?:^|; ){before}(?:p [^;]*?)?\b{letter} {number} to {number}", interval)
    if value is None or ends is None:
        return None
    return Interval(*(1 + float(text) / 100 for text in (value[1], ends[1], ends[2])))
