"""What a comparison of two trees comes to: counts, means by group, and what to beware of."""

from __future__ import annotations

import pandas as pd

from synfeal.bootstrap import CONFIDENCE, FEWEST_PATHS
from synfeal.report.compare.trees import Comparison
from synfeal.report.stats import MEASURES, sign_test

GROUPINGS = ("scene", "labels", "model")


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """Runs by measure: how many are ``better``, ``worse`` or ``unseen`` by their intervals.

    And how many are ``lower`` or ``higher``, by however little, with ``p_sign`` of a two-sided sign
    test of these (1 without either); and ``percent``, the mean relative change.
    """
    return pd.DataFrame([_summary(rows) for _, rows in table.groupby("measure", sort=False)])


def _summary(rows: pd.DataFrame) -> dict[str, object]:
    verdicts = rows["verdict"].tolist()
    lower, signed, p_sign = sign_test(rows["difference"].tolist())
    return {
        "measure": rows["measure"].iloc[0],
        "better": verdicts.count("better"),
        "worse": verdicts.count("worse"),
        "unseen": verdicts.count("no difference seen"),
        "lower": lower,
        "higher": signed - lower,
        "p_sign": p_sign,
        "percent": rows["change_percent"].mean(),
    }


def groups_of(table: pd.DataFrame) -> pd.DataFrame:
    """Mean relative changes by scene, label source and model, in order of appearance.

    Columns are ``grouping``, ``name``, ``n_runs``, and a mean for each measure, infinite where a
    run of the group failed in B only.
    """
    parts = []
    for grouping in GROUPINGS:
        groups = table.groupby([grouping, "measure"], sort=False)["change_percent"]
        means = groups.mean().unstack("measure", sort=False)
        means.insert(0, "n_runs", groups.size().unstack("measure")[MEASURES[0]])
        parts.append(means.rename_axis("name").reset_index().assign(grouping=grouping))
    return pd.concat(parts, ignore_index=True)


def remarks_of(comparison: Comparison) -> list[str]:
    """Sentences on how the runs were matched and how far the numbers carry."""
    runs = comparison.runs
    only_a, only_b = comparison.only
    by_chance = (1 - CONFIDENCE) * len(runs)
    few = int((runs[["n_paths_a", "n_paths_b"]].min(axis="columns") < FEWEST_PATHS).sum())
    failed_a, failed_b = runs["failed_a"].sum(), runs["failed_b"].sum()
    changes = comparison.changes
    found = {
        f"Runs in both trees: {len(runs)}; only in A: {only_a}; only in B: {only_b}.": True,
        _pairing(runs): True,
        **_labels(runs),
        f"Runs with fewer than {FEWEST_PATHS} test paths: {few}; their intervals are too narrow,"
        " hence the question marks.": few,
        _seeds(runs): True,
        f"Failed predictions: {failed_a} in A, {failed_b} in B; each counts as an infinite"
        " error.": failed_a + failed_b,
        f"Were both trees equally good on all views, about {by_chance:.1f} of the {len(runs)}"
        " intervals of a measure would still miss zero by the choice of test paths. Runs share test"
        " frames, so the sign test is a guide, not a proof.": True,
        f"Keys of provenance.json that differ: {0 if changes is None else len(changes)}.": (
            changes is not None
        ),
    }
    return [sentence for sentence, applies in found.items() if applies]


def _pairing(runs: pd.DataFrame) -> str:
    differ, unknown = ((runs["test_frames"] == found).sum() for found in ("differ", "unknown"))
    if not differ + unknown:
        return "Frames are paired: both trees test on the same paths and true poses (plans)."
    reasons = [f"in {differ} the test frames differ"] if differ else []
    reasons += [f"for {unknown} a tree lacks plans/<scene>/test.csv"] if unknown else []
    return (
        f"Frames are paired in {len(runs) - differ - unknown} of {len(runs)} runs; the intervals of"
        f" the others are unpaired, hence wider: {' and '.join(reasons)}."
    )


def _labels(runs: pd.DataFrame) -> dict[str, bool]:
    """Sentences on the test labels, and whether they apply."""
    differ, unknown = ((runs["test_labels"] == found).sum() for found in ("differ", "unknown"))
    return {
        f"Runs with other test labels in B: {differ}; against the labels, their yardstick changed"
        " too.": bool(differ),
        f"Runs whose test labels a tree lacks (labels/…/test.csv): {unknown}; whether their"
        " yardstick changed is unknown.": bool(unknown),
    }


def _seeds(runs: pd.DataFrame) -> str:
    single = (runs[["n_seeds_a", "n_seeds_b"]].min(axis="columns") < 2).sum()
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
