"""Section 4.2: noise in the labels."""

from __future__ import annotations

from statistics import fmean

from synfeal.bootstrap import Array, difference, mean_of, relative_change
from synfeal.config import MODELS
from synfeal.report.claims.evidence import Cell, Errors, Evidence
from synfeal.report.claims.model import Claim, Outcome
from synfeal.report.claims.text import (
    PERCENT,
    conditions_text,
    limits_text,
    reached_text,
    values_text,
)
from synfeal.report.claims.verdicts import all_of, below_zero, reaches
from synfeal.report.stats import kendall_tau

# Table 3, from no noise to the highest level of each block.
LEVELS = {
    "orientation": ("synfeal", "noise-p0-r5", "noise-p0-r10", "noise-p0-r20"),
    "position": ("synfeal", "noise-p0.075-r0", "noise-p0.15-r0", "noise-p0.3-r0"),
    "both": ("synfeal", "noise-p0.1-r5", "noise-p0.2-r10", "noise-p0.3-r20"),
}


def kind_of_noise(claim: Claim, evidence: Evidence) -> Outcome:
    """C5: each block raises the error it names, and by more than the other; both raise both."""
    increases = {block: _increase(evidence, block) for block in LEVELS}
    orientation, position, both = (increases[b] for b in ("orientation", "position", "both"))
    conditions = [
        orientation.orientation,
        difference(orientation.orientation, orientation.position),
        position.position,
        difference(position.position, position.orientation),
        *both,
    ]
    parts = [below_zero(-condition, len(conditions)) for condition in conditions]
    measured = [
        f"{block}: {values_text(PERCENT, found)} ({_tau_text(evidence, block)})"
        for block, found in increases.items()
    ]
    spans = [f"{block}: {limits_text(PERCENT, found)}" for block, found in increases.items()]
    return Outcome(all_of(parts), "; ".join(measured), "; ".join(spans), conditions_text(parts))


def highest_noise(claim: Claim, evidence: Evidence) -> Outcome:
    """C6: the noisy error exceeds the clean one by the published share of the noisy, or more."""
    clean = evidence.errors(Cell("posenet2"))
    noisy = evidence.errors(Cell("posenet2", labels=LEVELS["both"][-1]))
    pairs = list(zip(clean, noisy, strict=True))
    shares = [-relative_change(before, after) for before, after in pairs]
    over_clean = [relative_change(after, before) for before, after in pairs]
    parts = [reaches(s, n, 2) for s, n in zip(shares, claim.numbers, strict=True)]
    measured = f"{values_text(PERCENT, shares)} (over clean {values_text(PERCENT, over_clean)})"
    return Outcome(
        all_of(parts), measured, limits_text(PERCENT, shares), reached_text(shares, claim, parts)
    )


def _increase(evidence: Evidence, block: str) -> Errors:
    """Relative increase from no noise to the highest level, mean over the localizers."""
    first, last = LEVELS[block][0], LEVELS[block][-1]
    clean = [evidence.errors(Cell(model, labels=first)) for model in MODELS]
    noisy = [evidence.errors(Cell(model, labels=last)) for model in MODELS]
    return Errors(*(_mean_change(noisy, clean, i) for i in range(2)))


def _mean_change(new: list[Errors], old: list[Errors], which: int) -> Array:
    pairs = zip(new, old, strict=True)
    return mean_of([relative_change(a[which], b[which]) for a, b in pairs])


def _tau_text(evidence: Evidence, block: str) -> str:
    labels = LEVELS[block]
    means = []
    for which in range(2):
        series = [
            [float(evidence.errors(Cell(model, labels=name))[which][0]) for name in labels]
            for model in MODELS
        ]
        means.append(fmean(kendall_tau(range(len(labels)), errors) for errors in series))
    return f"tau p {means[0]:+.2f}, o {means[1]:+.2f}"
