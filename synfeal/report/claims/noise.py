"""Section 4.2: noise in the labels."""

from __future__ import annotations

from dataclasses import replace
from statistics import fmean

from synfeal.bootstrap import Array, difference, mean_of, relative_change
from synfeal.config import MODELS
from synfeal.report.claims.evidence import Cell, Errors, Evidence
from synfeal.report.claims.label_sources import changes, effects
from synfeal.report.claims.model import Claim, Outcome
from synfeal.report.claims.text import PERCENT, limits_text, values_text
from synfeal.report.claims.verdicts import Condition, all_of
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
    conditions = {
        "orientation noise on orientation": orientation.orientation,
        "more than on position": difference(orientation.orientation, orientation.position),
        "position noise on position": position.position,
        "more than on orientation": difference(position.position, position.orientation),
        "both on position": both.position,
        "both on orientation": both.orientation,
    }
    verdict, reason = all_of([Condition(*condition) for condition in conditions.items()])
    measured = [
        f"{block}: {values_text(PERCENT, found)} ({_tau_text(evidence, block)})"
        for block, found in increases.items()
    ]
    spans = [f"{block}: {limits_text(PERCENT, found)}" for block, found in increases.items()]
    return Outcome(verdict, "; ".join(measured), "; ".join(spans), reason)


def highest_noise(claim: Claim, evidence: Evidence) -> Outcome:
    """C6: the noisy error exceeds the clean one by a share of the noisy, the paper's base."""
    clean, noisy = Cell("posenet2"), Cell("posenet2", labels=LEVELS["both"][-1])
    shares = Errors(*(-change for change in changes(evidence, clean, noisy)))
    over_clean = values_text(PERCENT, changes(evidence, noisy, clean))
    outcome = effects(shares, claim)
    return replace(outcome, measured=f"{outcome.measured} (over clean {over_clean})")


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
