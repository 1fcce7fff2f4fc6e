"""``claims.csv``: the verdict of a run on every claim of the paper."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from reproduction.claims.evidence import Evidence, evidence_of
from reproduction.claims.judging import judge, views
from reproduction.claims.rules import frozen_rules
from reproduction.claims.verdicts import GROUPS, Claim, Outcome, Verdict, published_claims
from reproduction.design.experiments import Design
from synfeal.records.tables import write_frame

COLUMNS = (
    "id",
    "section",
    "group",
    "statement",
    "published",
    "measured_labels",
    "measured_true",
    "interval_labels",
    "interval_true",
    "test",
    "verdict_labels",
    "verdict_true",
    "sensitivity_labels",
    "sensitivity_true",
    "dose",
    "test_paths_labels",
    "test_paths_true",
    "seeds",
    "limits_of",
    "seed",
    "rules",
    "reason",
    "footnote",
    "evidence",
)
HEADINGS = (
    "",
    "Claim",
    "Published",
    "Against the labels (the paper's protocol)",
    "Verdict",
    "Against the true poses",
    "Verdict",
)
Row = Mapping[str, str]


def write_claims(design: Design, root: Path, seed: int, out_csv: Path) -> None:
    """Write one row per claim of the paper, columns :data:`COLUMNS`.

    Args:
        design: The profile's table of experiments.
        root: Results of the profile.
        seed: Seed of the profile, from which all others follow.
        out_csv: CSV to write.
    """
    rows = claim_rows(evidence_of(design, root), seed)
    write_frame(out_csv, pd.DataFrame(rows, columns=list(COLUMNS)))


def claim_rows(evidence: Evidence, seed: int = 0) -> list[dict[str, str]]:
    """Tabulate the claims, one row each, by column."""
    tag = frozen_rules().tag
    return [
        _row(claim, evidence) | {"seed": str(seed), "rules": tag} for claim in published_claims()
    ]


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


def _row(claim: Claim, evidence: Evidence) -> dict[str, str]:
    by_score = views(claim, evidence)
    outcomes = {score: judge(claim, view) for score, view in by_score.items()}
    row = {name: getattr(claim, name) for name in COLUMNS if hasattr(claim, name)}
    for score, outcome in outcomes.items():
        row[f"measured_{score}"] = outcome.measured
        row[f"interval_{score}"] = outcome.interval
        row[f"verdict_{score}"] = outcome.verdict
        row[f"test_paths_{score}"] = str(min(by_score[score].test_paths.values(), default=""))
        row[f"sensitivity_{score}"] = _sensitivity(outcome)
    seeds = sorted({n for view in by_score.values() for n in view.seeds})
    row["seeds"] = " to ".join(map(str, dict.fromkeys((seeds[0], seeds[-1])))) if seeds else ""
    row["limits_of"] = _limits_of(seeds)
    row["dose"] = next((o.dose for o in outcomes.values() if o.dose), "")
    reasons = {outcome.reason: score for score, outcome in outcomes.items()}
    named = "; ".join(f"{score}: {reason}" for reason, score in reasons.items())
    row["reason"] = named if len(reasons) > 1 else next(iter(reasons))
    row["evidence"] = ";".join(dict.fromkeys(f for view in by_score.values() for f in view.used))
    return row


def _sensitivity(outcome: Outcome) -> str:
    """List other thresholds that would change a verdict, and to what."""
    if outcome.verdict in (Verdict.NOT_TESTABLE, Verdict.NOT_LEARNT, Verdict.BY_CONSTRUCTION):
        return ""
    return "; ".join(f"{name}: {other}" for name, other in outcome.turned.items()) or "none"


def _limits_of(seeds: Sequence[int]) -> str:
    """Say what the limits of a claim cover, given the repetitions of its cells."""
    if not seeds:
        return ""  # no localizer was asked
    borrowed = "paths, and seeds as in the published runs"
    if seeds == [1]:
        return borrowed
    return "paths and seeds" + (f"; of single runs {borrowed}" if seeds[0] == 1 else "")


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
