"""Sections 4.1 and 4.2: labels of SfM and RGB-D SLAM, and labels with noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from statistics import fmean

import numpy as np

from baselines.config.learning import MODELS
from reproduction.claims.evidence import QUANTITIES, Cell, Evidence
from reproduction.claims.verdicts import (
    PERCENT,
    Claim,
    Condition,
    Judgement,
    Outcome,
    all_of,
    limits_text,
    values_text,
)
from reproduction.statistics.limits import MEASURES, kendall_tau, sign_test
from reproduction.tables.layouts import SOURCES, TITLES
from synfeal.dataset.pose_table import read_pose_table
from synfeal.evaluation.bootstrap import Array, difference, mean_of, relative_change
from synfeal.evaluation.metrics import pose_errors

RIVALS = ("sfm", "rgbd-toro", "rgbd-g2o")
# Table 3, from no noise to the highest level of each block.
LEVELS = {
    "orientation": ("synfeal", "noise-p0-r5", "noise-p0-r10", "noise-p0-r20"),
    "position": ("synfeal", "noise-p0.075-r0", "noise-p0.15-r0", "noise-p0.3-r0"),
    "both": ("synfeal", "noise-p0.1-r5", "noise-p0.2-r10", "noise-p0.3-r20"),
}


def changes(evidence: Evidence, new: Sequence[Cell], old: Sequence[Cell]) -> Array:
    """Compute the relative changes of both median errors between pairs of cells.

    Args:
        evidence: Results to read the errors from.
        new: Cells (N).
        old: Cells (N) that each of them is compared with.

    Returns:
        Changes in percent (N, 2, B), position before orientation: negative where ``new`` is better.
        The last axis is a sample; see :class:`~reproduction.statistics.seeds.Layout`.
    """
    return relative_change(evidence.errors(*new), evidence.errors(*old))


def effects(found: Array, claim: Claim, evidence: Evidence) -> Outcome:
    """Judge the changes of both errors against the two that the paper prints.

    Args:
        found: Changes in percent (2, B), position before orientation.
        claim: Claim whose ``numbers`` are the printed changes, with the sign of the claimed
            direction.
        evidence: Results the changes were computed from, for the layout of their samples.
    """
    signs = np.sign(claim.numbers)
    conditions = [
        Condition(name, sign * sample, evidence.layout, number)
        for name, sign, sample, number in zip(QUANTITIES, signs, found, claim.numbers, strict=True)
    ]
    judged = all_of(conditions)
    spans = limits_text(PERCENT, found, evidence.layout)
    return Outcome(judged.verdict, values_text(PERCENT, found), spans, judged.reason, judged.turned)


def every_localizer(
    found: Array, groups: Sequence[str], joint: str, evidence: Evidence
) -> Judgement:
    """Judge a claim about all localizers by its mean effects, which no single effect may refute.

    Args:
        found: Effects in percent (groups, localizers, 2, B), positive in the claimed direction.
        groups: Names of the groups, as verdicts print them.
        joint: Text between the names of a localizer and a group, such as `` with ``.
        evidence: Results the effects were computed from, for the layout of their samples.
    """
    means = [
        Condition(f"{group} {name}", mean, evidence.layout)
        for group, part in zip(groups, found, strict=True)
        for name, mean in zip(QUANTITIES, mean_of(list(part)), strict=True)
    ]
    names = product(groups, MODELS, QUANTITIES)
    each = [
        Condition(f"{TITLES[model]}{joint}{group} {name}", effect, evidence.layout)
        for (group, model, name), effect in zip(names, _effects(found), strict=True)
    ]
    return all_of(means, each=each)


def _effects(found: Array) -> Array:
    """Flatten samples of effects (..., 2, 1 + RESAMPLES) to (N, ...)."""
    return found.reshape(-1, found.shape[-1])


def lowest_of_all(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C1: relative changes from each rival's labels to the simulator's are below 0."""
    ours = [Cell(model) for model in MODELS]
    rivals = [[Cell(model, labels=rival) for model in MODELS] for rival in RIVALS]
    found = np.array([changes(evidence, ours, cells) for cells in rivals])
    names = [SOURCES[rival] for rival in RIVALS]
    judged = every_localizer(-found, names, " with ", evidence)
    lowest = int(np.all(found[..., 0] < 0, axis=0).sum())
    tests = []
    for rival, each in zip(RIVALS, found[..., 0], strict=True):
        lower, counted, chance = sign_test(each.ravel().tolist())
        tests.append(f"{SOURCES[rival]} {lower} of {counted} lower (p = {chance:.3g})")
    measured = f"lowest in {lowest} of {found[0, ..., 0].size} columns"
    spans = [
        f"{name}: {limits_text(PERCENT, mean_of(list(part)), evidence.layout)}"
        for name, part in zip(names, found, strict=True)
    ]
    return Outcome(
        judged.verdict,
        f"{measured}; sign tests: {', '.join(tests)}",
        "; ".join(spans),
        judged.reason,
        judged.turned,
        _dose_text(evidence, RIVALS, ours),
    )


def gain_over_sfm(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C2: PoseNet2's errors fall by two thirds of the published share, or by more."""
    ours = [Cell("posenet2")]
    found = changes(evidence, ours, [Cell("posenet2", labels="sfm")])[0]
    outcome = effects(found, claim, evidence)
    return replace(outcome, dose=_dose_text(evidence, ["sfm"], ours))


def labels_against_models(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C3: better labels and the newer model cut the errors, and labels cut them more.

    Without the first two conditions the claim could hold because the newer model is worse.
    """
    others = [Cell("posenet2", labels="sfm"), Cell("posenet")]
    by_labels, by_model = changes(evidence, [Cell("posenet2")] * 2, others)
    gaps = difference(by_labels, by_model)
    parts = {"better labels": by_labels, "newer model": by_model, "labels more than model": gaps}
    judged = all_of(
        [
            Condition(f"{part}, {name}", -sample, evidence.layout)
            for part, found in parts.items()
            for name, sample in zip(QUANTITIES, found, strict=True)
        ]
    )
    measured = f"labels {values_text(PERCENT, by_labels)}; model {values_text(PERCENT, by_model)}"
    spans = [
        f"{part}: {limits_text(PERCENT, found, evidence.layout)}" for part, found in parts.items()
    ]
    dose = _dose_text(evidence, ["sfm"], [Cell("posenet2")])
    return Outcome(judged.verdict, measured, "; ".join(spans), judged.reason, judged.turned, dose)


def kind_of_noise(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C5: each block raises the error it names more than the other; both raise both."""
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
    judged = all_of(
        [Condition(name, effect, evidence.layout) for name, effect in conditions.items()]
    )
    measured = [
        f"{block}: {values_text(PERCENT, found)} ({_tau_text(evidence, LEVELS[block])})"
        for block, found in increases.items()
    ]
    spans = [
        f"{block}: {limits_text(PERCENT, found, evidence.layout)}"
        for block, found in increases.items()
    ]
    return Outcome(
        judged.verdict, "; ".join(measured), "; ".join(spans), judged.reason, judged.turned
    )


def highest_noise(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C6: the noisy error exceeds the clean one by a share of the noisy, the paper's base."""
    clean, noisy = [Cell("posenet2")], [Cell("posenet2", labels=LEVELS["both"][-1])]
    outcome = effects(-changes(evidence, clean, noisy)[0], claim, evidence)
    over_clean = values_text(PERCENT, changes(evidence, noisy, clean)[0])
    return replace(outcome, measured=f"{outcome.measured} (over clean {over_clean})")


def _increase(evidence: Evidence, labels: Sequence[str]) -> Array:
    """Compute the relative increase from no noise to the highest level (2, ...), averaged."""
    ends = ([Cell(model, labels=name) for model in MODELS] for name in (labels[-1], labels[0]))
    return mean_of(list(changes(evidence, *ends)))


def _dose_text(evidence: Evidence, rivals: Sequence[str], cells: Sequence[Cell]) -> str:
    """Say how exact the compared labels are, beside localizers trained on the truth.

    Labels that are ten times as exact as a localizer cannot move its errors by much.
    """
    folder = "labels/large_room/6k"
    truth = read_pose_table(evidence.file(f"{folder}/synfeal/train.csv"))
    doses = []
    for rival in rivals:
        labels = read_pose_table(evidence.file(f"{folder}/{rival}/train.csv"))
        found = pose_errors(labels, truth)
        metres, degrees = (float(np.median(found[measure])) for measure in MEASURES[:2])
        doses.append(f"{SOURCES[rival]} {100 * metres:.1f} cm/{degrees:.1f}°")
    metres, degrees = evidence.errors(*cells)[:, :, 0].mean(axis=0)
    errors = f"localizers trained on exact labels {100 * metres:.0f} cm/{degrees:.1f}°"
    return f"median error of the training labels: {', '.join(doses)}; of {errors}"


def _tau_text(evidence: Evidence, labels: Sequence[str]) -> str:
    """Format Kendall's tau of error and level, mean over the localizers."""
    errors = np.array(
        [evidence.errors(*(Cell(m, labels=name) for name in labels))[:, :, 0] for m in MODELS]
    )
    position, orientation = (
        fmean(kendall_tau(range(len(labels)), series.tolist()) for series in errors[:, :, which])
        for which in range(2)
    )
    return f"tau p {position:+.2f}, o {orientation:+.2f}"
