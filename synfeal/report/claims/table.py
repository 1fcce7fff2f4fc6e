"""Every claim with the function that tests it, and ``claims.csv``, which they make."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import pandas as pd

from synfeal.bootstrap import FEWEST_PATHS
from synfeal.config import MODELS, Design
from synfeal.frames import write_frame
from synfeal.report.claims import labels, training, untrained
from synfeal.report.claims.evidence import COMMON, Cell, Evidence, evidence_of
from synfeal.report.claims.verdicts import Claim, Missing, Outcome, Verdict, published_claims

JUDGES: Mapping[str, Callable[[Claim, Evidence], Outcome]] = {
    "C1": labels.lowest_of_all,
    "C2": labels.gain_over_sfm,
    "C3": labels.labels_against_models,
    "C4": untrained.few_assisted,
    "C5": labels.kind_of_noise,
    "C6": labels.highest_noise,
    "C7": partial(training.grows, scene="large_room"),
    "C8": partial(training.grows, scene="sanctuary"),
    "C9": training.sanctuary_at_6k,
    "C10": training.worse_when_small,
    "C11": training.better_when_large,
    "C12": training.best_of_all,
    "C13": training.longer,
    "C14": untrained.collection_rate,
    "C15": untrained.kinectfusion_fails,
    "C16": untrained.times_7_scenes,
}


def _cells(*models: str, scene: str = "large_room", sizes: tuple[str, ...] = ("6k",)) -> list[Cell]:
    return [Cell(model, scene, one) for one in sizes for model in models or MODELS]


# What has to have learnt from true labels before a claim about localizers says anything. C9 claims
# that something is not learnt.
LEARNT: Mapping[str, list[Cell]] = {
    "C1": _cells(),
    "C2": _cells("posenet2"),
    "C3": _cells("posenet", "posenet2"),
    "C5": _cells(),
    "C6": _cells("posenet2"),
    "C7": _cells(sizes=("80k",)),
    "C8": _cells(scene="sanctuary", sizes=("95k",)),
    "C10": _cells(sizes=("6k", "20k")),
    "C11": _cells(sizes=("80k",)),
    "C12": _cells(sizes=("80k",)),
    "C13": _cells(),
}


# What these compare are labels other than the true poses, which own test sets alone have; C15 asks
# how far apart neighbouring frames are.
ON_OWN_TEST_SET = {"labels": ("C1", "C2", "C3", "C5", "C6", "C15"), "true": ("C15",)}


def views(claim: Claim, evidence: Evidence) -> dict[str, Evidence]:
    """The results that a claim is judged on, by score: on the common test set where it can be."""
    return {
        score: evidence.under(score if claim.id in own else COMMON)
        for score, own in ON_OWN_TEST_SET.items()
    }


def judge(claim: Claim, evidence: Evidence) -> Outcome:
    """The verdict of a claim's own rule.

    What the profile does not make leaves it ``not testable here``. Where the localizers it rests on
    have not learnt it is ``not learnt at this scale``, and with fewer than ten paths in a test set
    nothing is decided, whatever the rule says.
    """
    try:
        outcome = JUDGES[claim.id](claim, evidence)
        unlearnt = evidence.not_learnt(LEARNT.get(claim.id, []))
    except Missing as missing:
        evidence.used.clear()  # half of what a test needs is no evidence
        return Outcome(Verdict.NOT_TESTABLE, reason=str(missing))
    if unlearnt:
        more = f" and {len(unlearnt) - 1} more" if len(unlearnt) > 1 else ""
        return replace(outcome, verdict=Verdict.NOT_LEARNT, reason=f"{unlearnt[0]}{more}")
    fewest = min(evidence.test_paths.values(), default=FEWEST_PATHS)
    if fewest < FEWEST_PATHS and outcome.verdict != Verdict.UNDECIDED:
        reason = f"a test set has {fewest} paths, fewer than {FEWEST_PATHS}; {outcome.reason}"
        return replace(outcome, verdict=Verdict.UNDECIDED, reason=reason)
    return outcome


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
    reasons = {outcome.reason: score for score, outcome in outcomes.items()}
    named = "; ".join(f"{score}: {reason}" for reason, score in reasons.items())
    row["reason"] = named if len(reasons) > 1 else next(iter(reasons))
    row["evidence"] = ";".join(dict.fromkeys(f for view in by_score.values() for f in view.used))
    return row


def _short(row: Row) -> list[str]:
    same = row["measured_true"] == row["measured_labels"]
    measured = row["measured_labels"], "the same" if same else row["measured_true"]
    # The statistic the rule decides on; what is only reported beside it stays in the CSV.
    first, second = (re.split("; (?:sign tests|tau)", text)[0] for text in measured)
    verdicts = [f"**{row[f'verdict_{score}']}**" for score in ("labels", "true")]
    head = [row["id"], row["statement"], row["published"]]
    return [*head, first or "–", verdicts[0], second if first else "–", verdicts[1]]


def _remarks(row: Row) -> list[str]:
    found = {row["verdict_labels"], row["verdict_true"]}
    untested = found & {Verdict.NOT_TESTABLE, Verdict.NOT_LEARNT}
    return [text for text in (row["reason"] if untested else "", row["footnote"]) if text]
