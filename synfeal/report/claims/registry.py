"""Every claim and the function that tests it. A claim without a test would be a KeyError."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from synfeal.bootstrap import FEWEST_PATHS
from synfeal.report.claims import label_sources, noise, scratch, simulator, size
from synfeal.report.claims.evidence import Evidence
from synfeal.report.claims.model import (
    FAILS,
    HOLDS,
    NOT_TESTABLE,
    UNDECIDED,
    Claim,
    Missing,
    Outcome,
)

JUDGES: Mapping[str, Callable[[Claim, Evidence], Outcome]] = {
    "C1": label_sources.lowest_of_all,
    "C2": label_sources.gain_over_sfm,
    "C3": label_sources.labels_against_models,
    "C4": label_sources.few_assisted,
    "C5": noise.kind_of_noise,
    "C6": noise.highest_noise,
    "C7": size.large_room_grows,
    "C8": size.sanctuary_grows,
    "C9": size.sanctuary_at_6k,
    "C10": scratch.worse_when_small,
    "C11": scratch.better_when_large,
    "C12": scratch.best_of_all,
    "C13": scratch.longer,
    "C14": simulator.collection_rate,
    "C15": label_sources.kinectfusion_fails,
    "C16": simulator.times_7_scenes,
}


def judge(claim: Claim, evidence: Evidence) -> Outcome:
    """The verdict of a claim's own rule.

    What is missing makes it ``not testable here``. With fewer than ten paths in a test set nothing
    is decided, whatever the rule says.

    Raises:
        InputError: a result file cannot be read.
    """
    try:
        outcome = JUDGES[claim.id](claim, evidence)
    except Missing as missing:
        evidence.used.clear()  # half of what a test needs is no evidence
        return Outcome(NOT_TESTABLE, reason=str(missing))
    fewest = min(evidence.test_paths.values(), default=FEWEST_PATHS)
    if fewest < FEWEST_PATHS and outcome.verdict in (HOLDS, FAILS):
        reason = f"a test set has {fewest} paths, fewer than {FEWEST_PATHS}; {outcome.reason}"
        return Outcome(UNDECIDED, outcome.measured, outcome.interval, reason)
    return outcome
