"""The claims as files: ``claims.csv``, and a short table in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from synfeal.config import Design
from synfeal.frames import write_frame
from synfeal.report.claims.evidence import Evidence, evidence_of
from synfeal.report.claims.model import NOT_LEARNT, NOT_TESTABLE, Claim, published_claims
from synfeal.report.claims.registry import judge, views

COLUMNS = (
    *("id", "section", "statement", "published", "measured_labels", "measured_true"),
    *("interval_labels", "interval_true", "test", "verdict_labels", "verdict_true"),
    *("test_paths_labels", "test_paths_true", "reason", "footnote", "evidence"),
)
HEADINGS = (
    *("", "Claim", "Published", "Against the labels (the paper's protocol)", "Verdict"),
    *("Against the true poses", "Verdict"),
)
Row = Mapping[str, str]


def write_claims(design: Design, root: Path, out_csv: Path) -> None:
    """Write one row per claim of the paper, columns :data:`COLUMNS`."""
    write_frame(out_csv, pd.DataFrame(claim_rows(evidence_of(design, root)), columns=list(COLUMNS)))


def claim_rows(evidence: Evidence) -> list[dict[str, str]]:
    """One row per claim, by column."""
    return [_row(claim, evidence) for claim in published_claims()]


def claims_markdown(rows: Sequence[Row]) -> str:
    """The claims in short: figures and verdicts under both scores, remarks below."""
    lines = [HEADINGS, ["---"] * len(HEADINGS), *map(_short, rows)]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    remarks = [f"- {row['id']}: {remark}" for row in rows for remark in _remarks(row)]
    return "\n\n".join(part for part in (table, "\n".join(remarks)) if part) + "\n"


def _row(claim: Claim, evidence: Evidence) -> dict[str, str]:
    by_score = views(claim, evidence)
    outcomes = {score: judge(claim, view) for score, view in by_score.items()}
    row = {name: getattr(claim, name) for name in COLUMNS if hasattr(claim, name)}
    for score, outcome in outcomes.items():
        row[f"measured_{score}"] = outcome.measured
        row[f"interval_{score}"] = outcome.interval
        row[f"verdict_{score}"] = outcome.verdict
        row[f"test_paths_{score}"] = str(min(by_score[score].test_paths.values(), default=""))
    row["reason"] = _joined({score: outcome.reason for score, outcome in outcomes.items()})
    row["evidence"] = ";".join(dict.fromkeys(f for view in by_score.values() for f in view.used))
    return row


def _joined(reasons: Mapping[str, str]) -> str:
    """One reason where both scores have the same, else both by name."""
    if len(set(reasons.values())) == 1:
        return next(iter(reasons.values()))
    return "; ".join(f"{score}: {reason}" for score, reason in reasons.items())


def _short(row: Row) -> list[str]:
    same = row["measured_true"] == row["measured_labels"]
    measured = [row["measured_labels"], "the same" if same else row["measured_true"]]
    first, second = map(_without_details, measured)
    verdicts = [f"**{row[f'verdict_{score}']}**" for score in ("labels", "true")]
    head = [row["id"], row["statement"], row["published"]]
    return [*head, first or "–", verdicts[0], second if first else "–", verdicts[1]]


def _without_details(measured: str) -> str:
    """The statistic the rule decides on; what is only reported beside it stays in the CSV."""
    for detail in ("; sign tests", "; tau"):
        measured = measured.partition(detail)[0]
    return measured


def _remarks(row: Row) -> list[str]:
    untested = {NOT_TESTABLE, NOT_LEARNT} & {row["verdict_labels"], row["verdict_true"]}
    return [text for text in (row["reason"] if untested else "", row["footnote"]) if text]
