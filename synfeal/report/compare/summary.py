"""What a comparison of two trees comes to: counts, means by group, and what to beware of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean

from synfeal.bootstrap import CONFIDENCE, FEWEST_PATHS
from synfeal.report.compare.trees import Comparison, RunComparison
from synfeal.report.stats import MEASURES, sign_test

GROUPINGS = ("scene", "labels", "model")


@dataclass(frozen=True)
class MeasureSummary:
    """One measure over all runs.

    Attributes:
        measure: which.
        better: runs whose interval lies below zero.
        worse: runs whose interval lies above zero.
        unseen: the others.
        lower: runs whose median fell, by however little.
        higher: runs whose median rose.
        p_sign: two-sided p of a sign test of ``lower`` against ``higher``; 1 without either.
        percent: mean relative change, percent.
    """

    measure: str
    better: int
    worse: int
    unseen: int
    lower: int
    higher: int
    p_sign: float
    percent: float


@dataclass(frozen=True)
class GroupSummary:
    """Mean relative changes, percent, of the runs that share one part of their name."""

    grouping: str
    name: str
    n_runs: int
    percent: dict[str, float]


def summarise(runs: Sequence[RunComparison]) -> list[MeasureSummary]:
    """One summary per measure."""
    return [_summary(measure, runs) for measure in MEASURES]


def groups_of(runs: Sequence[RunComparison]) -> list[GroupSummary]:
    """Mean relative changes per scene, per label source and per model, in order of appearance."""
    return [
        GroupSummary(grouping, name, len(members), mean_percent(members))
        for grouping in GROUPINGS
        for name in dict.fromkeys(getattr(run.key, grouping) for run in runs)
        for members in [[run for run in runs if getattr(run.key, grouping) == name]]
    ]


def mean_percent(runs: Iterable[RunComparison]) -> dict[str, float]:
    """Mean relative change of each measure; infinite when a run failed in B only."""
    runs = list(runs)
    return {m: fmean(run.differences[m].percent for run in runs) for m in MEASURES}


def remarks_of(comparison: Comparison) -> list[str]:
    """Sentences on how the runs were matched and how far the numbers carry."""
    runs = comparison.runs
    only_a, only_b = comparison.only
    by_chance = (1 - CONFIDENCE) * len(runs)
    found = [
        f"Runs in both trees: {len(runs)}; only in A: {only_a}; only in B: {only_b}.",
        _pairing(runs),
        *_labels(runs),
        *_paths(runs),
        _seeds(runs),
        *_failures(runs),
        f"Were both trees equally good on all views, about {by_chance:.1f} of the {len(runs)}"
        " intervals of a measure would still miss zero by the choice of test paths. Runs share test"
        " frames, so the sign test is a guide, not a proof.",
    ]
    if comparison.changes is not None:
        found.append(f"Keys of provenance.json that differ: {len(comparison.changes)}.")
    return found


def _summary(measure: str, runs: Sequence[RunComparison]) -> MeasureSummary:
    found = [run.differences[measure] for run in runs]
    verdicts = [difference.verdict for difference in found]
    lower, signed, p_sign = sign_test([difference.value for difference in found])
    return MeasureSummary(
        measure=measure,
        better=verdicts.count("better"),
        worse=verdicts.count("worse"),
        unseen=verdicts.count("no difference seen"),
        lower=lower,
        higher=signed - lower,
        p_sign=p_sign,
        percent=mean_percent(runs)[measure],
    )


def _pairing(runs: Sequence[RunComparison]) -> str:
    if all(run.paired for run in runs):
        return "Frames are paired: both trees test on the same paths and true poses (plans)."
    differ = sum(run.plans == "differ" for run in runs)
    unknown = sum(run.plans == "unknown" for run in runs)
    reasons = [f"in {differ} the test frames differ"] if differ else []
    reasons += [f"for {unknown} a tree lacks plans/<scene>/test.csv"] if unknown else []
    return (
        f"Frames are paired in {len(runs) - differ - unknown} of {len(runs)} runs; the intervals of"
        f" the others are unpaired, hence wider: {' and '.join(reasons)}."
    )


def _labels(runs: Sequence[RunComparison]) -> list[str]:
    differ = sum(run.labels == "differ" for run in runs)
    unknown = sum(run.labels == "unknown" for run in runs)
    found = []
    if differ:
        found.append(
            f"Runs with other test labels in B: {differ}; against the labels, their yardstick"
            " changed too."
        )
    if unknown:
        found.append(
            f"Runs whose test labels a tree lacks (labels/…/test.csv): {unknown}; whether their"
            " yardstick changed is unknown."
        )
    return found


def _paths(runs: Sequence[RunComparison]) -> list[str]:
    few = sum(run.few_paths for run in runs)
    if not few:
        return []
    return [
        f"Runs with fewer than {FEWEST_PATHS} test paths: {few}; their intervals are too"
        " narrow, hence the question marks."
    ]


def _seeds(runs: Sequence[RunComparison]) -> str:
    single = sum(min(run.n_seeds) < 2 for run in runs)
    if single:
        return (
            f"Runs with one seed in a tree: {single}. Their intervals say how far the test frames"
            " decide; training again with another seed and no change could also look better or"
            " worse. Compare several seeds (training.repetitions) to tell."
        )
    return (
        "Intervals say how far the test frames decide; ± is the standard error from the spread over"
        " seeds. They are different uncertainties and are not merged."
    )


def _failures(runs: Sequence[RunComparison]) -> list[str]:
    failed_a, failed_b = (sum(run.failed[i] for run in runs) for i in (0, 1))
    if not failed_a + failed_b:
        return []
    return [
        f"Failed predictions: {failed_a} in A, {failed_b} in B; each counts as an infinite error."
    ]
