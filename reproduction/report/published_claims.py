"""Verdicts of single runs as they were published, in words, and the rules they were made by.

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
from reproduction.claims.tables import EFFECTS
from reproduction.claims.verdicts import FEW, GROUPS, Verdict, published_claims
from reproduction.report.intervals import Interval
from reproduction.statistics.limits import share_limits
from reproduction.tables.assistance import PUBLISHED_ASSISTED, PUBLISHED_SCENE, TOTAL
from reproduction.tables.assistance import SCHEMA as ASSISTANCE
from synfeal.records.tables import read_frame, read_records, rows_of

HEADINGS = (
    "",
    "Claim",
    "Published",
    "Against the labels (the paper's protocol)",
    "Verdict",
    "Against the true poses",
    "Verdict",
)
# Of files without a column ``rules``.
BEFORE_FREEZE = "2026-11-22g"
Row = Mapping[str, str]


def published_runs(published: Path) -> list[Path]:
    """List the folders of published runs whose verdicts are words, by name.

    Pooled replications, and runs judged as they are, have effects as numbers and are not among
    them.
    """
    folders = (path.parent for path in published.glob("*/claims.csv"))
    return sorted(folder for folder in folders if not (folder / EFFECTS).is_file())


def read_published(root: Path) -> list[dict[str, str]]:
    """Read the rows of ``claims.csv``, as they were published."""
    path = root / "claims.csv"
    return [row for _, row in read_records(path, ["id", "verdict_true"], "publish again")]


def rules_of(rows: Sequence[Row]) -> str:
    """Return the rules that verdicts were made by."""
    return rows[0].get("rules") or BEFORE_FREEZE


def claims_markdown(rows: Sequence[Row]) -> str:
    """Format the claims by group: figures and verdicts under both scores, remarks below.

    Rows of an earlier version, which have no groups, are grouped as the claims are now.
    """
    groups = {claim.id: claim.group for claim in published_claims()}
    parts = []
    for group, title in GROUPS.items():
        own = [row for row in rows if groups.get(row["id"]) == group]
        if own:
            lines = [HEADINGS, ["---"] * len(HEADINGS), *map(_short, own)]
            table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
            parts += [f"### Claims {title}", table]
    remarks = [f"- {row['id']}: {remark}" for row in rows for remark in _remarks(row)]
    return "\n\n".join(part for part in (*parts, "\n".join(remarks)) if part) + "\n"


def verdict_counts(rows: Sequence[Row], score: str) -> dict[str, Counter[str]]:
    """Count the claims of each group by verdict, under a score."""
    groups = {claim.id: claim.group for claim in published_claims()}
    return {
        group: Counter(row[f"verdict_{score}"] for row in rows if groups[row["id"]] == group)
        for group in GROUPS
    }


def few_verdict(counts: Mapping[str, tuple[int, int]]) -> Verdict:
    """Decide whether few batches of every method are assisted, one-sided at 5 %.

    Args:
        counts: Number of assisted batches, and of all, by method.
    """
    if all(share_limits(*count, 0.9)[1] < FEW for count in counts.values()):
        return Verdict.HOLDS
    least = [share_limits(*count, 1 - 0.1 / len(counts))[0] for count in counts.values()]
    return Verdict.OPPOSITE if max(least) > FEW else Verdict.UNDECIDED


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


def _short(row: Row) -> list[str]:
    same = row["measured_true"] == row["measured_labels"]
    measured = row["measured_labels"], "the same" if same else row["measured_true"]
    # The statistic the rule decides on; what is only reported beside it stays in the CSV.
    first, second = (re.split("; (?:sign tests|tau)", text)[0] for text in measured)
    verdicts = [f"**{row[f'verdict_{score}']}**" for score in ("labels", "true")]
    if row.get("dose"):
        first = f"{first} ({row['dose']})"
    head = [row["id"], row["statement"], row["published"]]
    return [*head, first or "–", verdicts[0], second if first else "–", verdicts[1]]


def _remarks(row: Row) -> list[str]:
    found = {row["verdict_labels"], row["verdict_true"]}
    untested = found & {Verdict.NOT_TESTABLE, Verdict.NOT_LEARNT}
    return [text for text in (row["reason"] if untested else "", row["footnote"]) if text]
