"""Claims that were judged with fresh seeds, and what it would take to judge the others.

The rules of the verdicts were changed after results had been seen, and are frozen since
(``docs/rules.md``). So only runs whose seeds no earlier run has used can test a claim. Runs of one
purpose test some of the claims each; this module collects their verdicts, and lists for every other
claim the run that would decide it, with the processor time that is planned for it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from reproduction.claims.rules import frozen_rules
from reproduction.claims.verdicts import GROUPS, Claim, Verdict, published_claims
from reproduction.plan.plan import planned_cpu_s
from reproduction.report.publish import PUBLISHED
from reproduction.report.published_claims import (
    published_runs,
    read_published,
    rules_of,
)
from reproduction.runs.results import read_result
from reproduction.tables.sheet import markdown_table

# All runs that were published before the rules were frozen, or that chose a setting, had this seed.
SEEN_SEED = "0"
# Runs that others are planned from.
PLANNED_FROM = (PUBLISHED / "mini", PUBLISHED / "night")
# No chance enters the claims about the set-up, and C9 is not judged (docs/rules.md).
NOT_DRAWN = ("C9",)
# Of these it was announced, before their last run, that no other would follow under the same rules.
NOT_AGAIN = ("C3", "C8", "C10")
# What `measured_true` has beside the changes that are judged.
BESIDE = re.compile("; (?:sign tests|tau)")
# Verdicts that say more than *smaller than published*: where one run gives one of them and another
# run that, they agree.
BELOW_PUBLISHED = (Verdict.SMALLER, Verdict.NEGLIGIBLE, Verdict.OPPOSITE)
NONE_YET = "No claim has been judged with fresh seeds yet."
CONTRADICTED = "runs contradict each other"
# Verdicts that leave a claim open.
OPEN = (Verdict.UNDECIDED, Verdict.NOT_TESTABLE, Verdict.NOT_LEARNT)


class JudgingRun(NamedTuple):
    """A run that judges claims.

    Attributes:
        profile: Name of its profile, ``config/<profile>.yaml``.
        claims: Claims it is for; it may have the rows of others.
    """

    profile: str
    claims: tuple[str, ...]


# The last one for a claim is the one to make more of where it stays open.
RUNS = (
    JudgingRun("labels", ("C1", "C2", "C3", "C4", "C6")),
    JudgingRun("dose", ("C5", "C6")),
    JudgingRun("controls", ("C7", "C11", "C12")),
    JudgingRun("sanctuary", ("C8",)),
    JudgingRun("transfer", ("C10", "C13")),
    JudgingRun("curves", ("C13",)),
    JudgingRun("scratch", ("C10",)),
    JudgingRun("tracking", ("C15",)),
    JudgingRun("better_labels", ("C3",)),
    JudgingRun("more_sanctuary", ("C8",)),
)


class Judged(NamedTuple):
    """A claim with the verdict of a run with a fresh seed.

    Attributes:
        claim: The claim.
        profile: Name of the run.
        row: Its row of ``claims.csv``.
    """

    claim: Claim
    profile: str
    row: Mapping[str, str]

    @property
    def verdict(self) -> str:
        """Return the verdicts against the labels and against the truth, or the one they share."""
        both = self.row["verdict_labels"], self.row["verdict_true"]
        return " / ".join(dict.fromkeys(both))

    @property
    def decided(self) -> bool:
        """Tell whether the errors against the truth decide the claim."""
        return self.row["verdict_true"] not in OPEN


def decided_verdicts(judged: Sequence[Judged]) -> set[str]:
    """Return what runs decide on a claim against the truth; several verdicts contradict each other.

    *Smaller than published* leaves open how much smaller, so that a verdict below the published
    effect bears it out (``BELOW_PUBLISHED``).

    Args:
        judged: All verdicts with fresh seeds on one claim, also those that leave it open.
    """
    found = {own.row["verdict_true"] for own in judged if own.decided}
    if not found.isdisjoint(BELOW_PUBLISHED):
        found.discard(Verdict.LESS)
    return found


def is_decided(judged: Sequence[Judged]) -> bool:
    """Tell whether runs decide a claim: one does, and none decides it otherwise."""
    return len(decided_verdicts(judged)) == 1


def claims_to_test() -> list[Claim]:
    """List the claims that seeds can decide: those about localization and about labels."""
    claims = [claim for claim in published_claims() if claim.id not in NOT_DRAWN]
    return [claim for claim in claims if claim.group != "set-up"]


def is_fresh(rows: Sequence[Mapping[str, str]]) -> bool:
    """Tell whether verdicts were made by the frozen rules, from a seed not used before them."""
    return rules_of(rows) == frozen_rules().tag and rows[0].get("seed") != SEEN_SEED


def judged_fresh(published: Path = PUBLISHED) -> dict[str, list[Judged]]:
    """Collect all verdicts with fresh seeds, by id of the claim, in the order of the claims.

    No verdict is passed over: a claim that several runs judge has all of theirs, first that of the
    run that is for it (``RUNS``), then the others by name.

    Args:
        published: Folder of the published runs.
    """
    claims = {claim.id: claim for claim in claims_to_test()}
    found: dict[str, list[Judged]] = {name: [] for name in claims}
    for root in published_runs(published):
        rows = read_published(root)
        if is_fresh(rows):
            for row in rows:
                if row["id"] in claims and row["verdict_true"] != Verdict.NOT_TESTABLE:
                    found[row["id"]].append(Judged(claims[row["id"]], root.name, row))
    meant = {(claim, run.profile) for run in RUNS for claim in run.claims}
    return {
        name: sorted(own, key=lambda judged: (name, judged.profile) not in meant)
        for name, own in found.items()
        if own
    }


def fresh_claims(published: Path = PUBLISHED) -> str:
    """Tabulate the claims judged with fresh seeds, and list what would decide the others."""
    judged = judged_fresh(published)
    rows = [
        {
            "": found.claim.id,
            "Claim": found.claim.statement,
            "Published": found.claim.published,
            "Against the true poses": BESIDE.split(found.row["measured_true"])[0],
            "95 % limits": found.row["interval_true"] or "–",
            "Verdict": f"**{found.verdict}**",
            "Run": f"`{found.profile}`",
        }
        for own in judged.values()
        for found in own
    ]
    parts = [_opening(judged), markdown_table(pd.DataFrame(rows)) if rows else ""]
    parts += [_runs(published, judged), _open(judged)]
    return "\n\n".join(part for part in parts if part)


def outcome(judged: Sequence[Judged]) -> str:
    """Return the verdict that runs come to on one claim, or that they contradict each other."""
    decided = decided_verdicts(judged)
    if len(decided) > 1:
        return CONTRADICTED
    return str(*(decided or {judged[0].row["verdict_true"]}))


def _counts(judged: Mapping[str, Sequence[Judged]]) -> str:
    """Say how many claims were judged with fresh seeds, and how they fared, group by group."""
    decided = sum(map(is_decided, judged.values()))
    groups = []
    for group, title in GROUPS.items():
        counts = Counter(outcome(own) for own in judged.values() if own[0].claim.group == group)
        if counts:
            found = ", ".join(f"{number} {name}" for name, number in counts.most_common())
            groups.append(f"*{title}* {found}")
    return (
        f"**With fresh seeds**, by rules that were frozen before, {len(judged)} of the"
        f" {len(claims_to_test())} claims about localization and labels have been judged so far,"
        f" and {decided} of them decided: {'; '.join(groups)}."
    )


def _opening(judged: Mapping[str, Sequence[Judged]]) -> str:
    """Say how the claims fared, and how to read a table with the verdicts of all runs."""
    if not judged:
        return NONE_YET
    rule = (
        " A claim that several runs judge has the verdicts of all; it counts as decided if one"
        " decides it and none decides it otherwise."
    )
    several = any(len(own) > 1 for own in judged.values())
    return (
        f"{_counts(judged)} Counted are verdicts against the true poses. Where the table has two"
        f" verdicts, the first is against the labels.{rule if several else ''}"
    )


def _runs(published: Path, judged: Mapping[str, Sequence[Judged]]) -> str:
    """Name the runs, each with its seed and commit."""
    seeds = {found.profile: found.row["seed"] for own in judged.values() for found in own}
    texts = []
    for profile, seed in seeds.items():
        record = read_result(published / profile / "provenance.json", ("commit",), "publish again")
        texts.append(f"`{profile}`: seed {seed}, commit `{record['commit'][:9]}`")
    return f"Runs: {'; '.join(texts)}." if texts else ""


def _open(judged: Mapping[str, Sequence[Judged]]) -> str:
    """List the claims that no fresh seed has decided, by the run that would."""
    items = []
    made = {found.profile for own in judged.values() for found in own}
    last = {claim: run for run in RUNS for claim in run.claims}
    for run in RUNS:
        left = [
            name
            for name in run.claims
            if last[name] == run and not is_decided(judged.get(name, ()))
        ]
        own = [f for name in left for f in judged.get(name, ()) if f.profile == run.profile]
        if trained := [found.claim.id for found in own if found.row["seeds"]]:
            hours = planned_hours(run.profile, "train")
            items.append(
                f"- {', '.join(trained)}: more training runs per cell of `{run.profile}`. As many"
                f" again are planned at {hours:.1f} hours of processor time;"
                " the part of the limits that training runs cause shrinks with the root of their"
                " number."
            )
        if counted := [found.claim.id for found in own if not found.row["seeds"]]:
            items.append(f"- {', '.join(counted)}: more batches than `{run.profile}` has.")
        if closed := [found.claim.id for found in own if found.claim.id in NOT_AGAIN]:
            items[-1] += (
                f" It was announced, though, that {', '.join(closed)} would not be run again under"
                " these rules ([rules.md](rules.md))."
            )
        if waiting := [name for name in left if name not in judged or run.profile not in made]:
            items.append(
                f"- {', '.join(waiting)}: profile `{run.profile}`, planned at"
                f" {planned_hours(run.profile):.1f} hours of processor time."
            )
    return "\n".join(["What would decide the others:", "", *items]) if items else ""


@cache
def planned_hours(profile: str, rule: str | None = None) -> float:
    """Return the hours of processor time that a run of a profile is planned at.

    Args:
        profile: Its name.
        rule: A rule, such as ``train``; None for the whole run.
    """
    seconds = planned_cpu_s(profile, PLANNED_FROM)
    return float(seconds.sum() if rule is None else seconds[rule]) / 3600
