"""Sections 4.1 and 4.2: labels of SfM and RGB-D SLAM, and labels with noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from statistics import fmean

import numpy as np

from synfeal.bootstrap import Array, difference, limits, mean_of, relative_change
from synfeal.config import MODELS
from synfeal.report.claims.evidence import QUANTITIES, Cell, Evidence
from synfeal.report.claims.verdicts import (
    PERCENT,
    Claim,
    Condition,
    Outcome,
    Verdict,
    all_of,
    limits_text,
    values_text,
)
from synfeal.report.layouts import SOURCES, TITLES
from synfeal.report.stats import kendall_tau, sign_test

RIVALS = ("sfm", "rgbd-toro", "rgbd-g2o")
# Table 3, from no noise to the highest level of each block.
LEVELS = {
    "orientation": ("synfeal", "noise-p0-r5", "noise-p0-r10", "noise-p0-r20"),
    "position": ("synfeal", "noise-p0.075-r0", "noise-p0.15-r0", "noise-p0.3-r0"),
    "both": ("synfeal", "noise-p0.1-r5", "noise-p0.2-r10", "noise-p0.3-r20"),
}


def changes(evidence: Evidence, new: Sequence[Cell], old: Sequence[Cell]) -> Array:
    """Relative change of both median errors from cells to others (N, 2, 1 + RESAMPLES), percent."""
    return relative_change(evidence.errors(*new), evidence.errors(*old))


def effects(found: Array, claim: Claim) -> Outcome:
    """Changes of both errors, percent, against the two that the paper prints."""
    signs = np.sign(claim.numbers)
    conditions = [
        Condition(name, sign * sample, number)
        for name, sign, sample, number in zip(QUANTITIES, signs, found, claim.numbers, strict=True)
    ]
    verdict, reason = all_of(conditions)
    return Outcome(verdict, values_text(PERCENT, found), limits_text(PERCENT, found), reason)


def every_localizer(found: Array, groups: Sequence[str], joint: str) -> tuple[Verdict, str]:
    """The verdict of a claim about all localizers, from effects (groups, localizers, 2, ...).

    ``joint`` stands between a localizer and a group in their names.
    """
    means = [
        Condition(f"{group} {name}", mean)
        for group, part in zip(groups, found, strict=True)
        for name, mean in zip(QUANTITIES, mean_of(list(part)), strict=True)
    ]
    names = product(groups, MODELS, QUANTITIES)
    each = [
        Condition(f"{TITLES[model]}{joint}{group} {name}", effect)
        for (group, model, name), effect in zip(names, _effects(found), strict=True)
    ]
    return all_of(means, each=each)


def _effects(found: Array) -> Array:
    """Samples (N, ...) of effects (..., 2, 1 + RESAMPLES), one after another."""
    return found.reshape(-1, found.shape[-1])


def lowest_of_all(claim: Claim, evidence: Evidence) -> Outcome:
    """C1: the relative changes from each rival's labels to the simulator's are below 0."""
    ours = [Cell(model) for model in MODELS]
    rivals = [[Cell(model, labels=rival) for model in MODELS] for rival in RIVALS]
    found = np.array([changes(evidence, ours, cells) for cells in rivals])
    verdict, reason = every_localizer(-found, [SOURCES[rival] for rival in RIVALS], " with ")
    lowest = _effects(np.all(found < 0, axis=0)).sum(axis=0).astype(float)
    low, high = limits(lowest)
    tests = []
    for rival, each in zip(RIVALS, found[..., 0], strict=True):
        lower, counted, chance = sign_test(each.ravel().tolist())
        tests.append(f"{SOURCES[rival]} {lower} of {counted} lower (p = {chance:.3g})")
    measured = f"lowest in {lowest[0]:.0f} of {found[0, ..., 0].size} columns"
    interval = f"{low:.0f} to {high:.0f} columns"
    return Outcome(verdict, f"{measured}; sign tests: {', '.join(tests)}", interval, reason)


def gain_over_sfm(claim: Claim, evidence: Evidence) -> Outcome:
    """C2: PoseNet2's errors fall by two thirds of the published share, or by more."""
    return effects(
        changes(evidence, [Cell("posenet2")], [Cell("posenet2", labels="sfm")])[0], claim
    )


def labels_against_models(claim: Claim, evidence: Evidence) -> Outcome:
    """C3: the relative change from better labels is below that from the better model."""
    others = [Cell("posenet2", labels="sfm"), Cell("posenet")]
    by_labels, by_model = changes(evidence, [Cell("posenet2")] * 2, others)
    gaps = difference(by_labels, by_model)
    verdict, reason = all_of([Condition(n, -g) for n, g in zip(QUANTITIES, gaps, strict=True)])
    measured = f"labels {values_text(PERCENT, by_labels)}; model {values_text(PERCENT, by_model)}"
    return Outcome(verdict, measured, f"labels less model: {limits_text(PERCENT, gaps)}", reason)


def kind_of_noise(claim: Claim, evidence: Evidence) -> Outcome:
    """C5: each block raises the error it names, and by more than the other; both raise both."""
    increases = {block: _increase(evidence, labels) for block, labels in LEVELS.items()}
    orientation, position, both = (increases[b] for b in ("orientation", "position", "both"))
    conditions = {
        "orientation noise on orientation": orientation[1],
        "more than on position": difference(orientation[1], orientation[0]),
        "position noise on position": position[0],
        "more than on orientation": difference(position[0], position[1]),
        "both on position": both[0],
        "both on orientation": both[1],
    }
    verdict, reason = all_of([Condition(*condition) for condition in conditions.items()])
    measured = [
        f"{block}: {values_text(PERCENT, found)} ({_tau_text(evidence, LEVELS[block])})"
        for block, found in increases.items()
    ]
    spans = [f"{block}: {limits_text(PERCENT, found)}" for block, found in increases.items()]
    return Outcome(verdict, "; ".join(measured), "; ".join(spans), reason)


def highest_noise(claim: Claim, evidence: Evidence) -> Outcome:
    """C6: the noisy error exceeds the clean one by a share of the noisy, the paper's base."""
    clean, noisy = [Cell("posenet2")], [Cell("posenet2", labels=LEVELS["both"][-1])]
    outcome = effects(-changes(evidence, clean, noisy)[0], claim)
    over_clean = values_text(PERCENT, changes(evidence, noisy, clean)[0])
    return replace(outcome, measured=f"{outcome.measured} (over clean {over_clean})")


def _increase(evidence: Evidence, labels: Sequence[str]) -> Array:
    """Relative increase from no noise to the highest level (2, ...), mean over the localizers."""
    ends = ([Cell(model, labels=name) for model in MODELS] for name in (labels[-1], labels[0]))
    return mean_of(list(changes(evidence, *ends)))


def _tau_text(evidence: Evidence, labels: Sequence[str]) -> str:
    """Mean over the localizers of Kendall's tau of error and level."""
    errors = np.array(
        [evidence.errors(*(Cell(m, labels=name) for name in labels))[:, :, 0] for m in MODELS]
    )
    position, orientation = (
        fmean(kendall_tau(range(len(labels)), series.tolist()) for series in errors[:, :, which])
        for which in range(2)
    )
    return f"tau p {position:+.2f}, o {orientation:+.2f}"
