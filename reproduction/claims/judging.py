"""The function that judges each claim, and the results it is judged on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from baselines.config.learning import MODELS
from reproduction.claims import labels, training, untrained
from reproduction.claims.evidence import COMMON, Cell, Evidence
from reproduction.claims.verdicts import Claim, Missing, Outcome, Verdict
from synfeal.evaluation.bootstrap import FEWEST_PATHS

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
    """Return the results that judge a claim, by score: on the common test set where possible."""
    return {
        score: evidence.under(score if claim.id in own else COMMON)
        for score, own in ON_OWN_TEST_SET.items()
    }


def judge(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge a claim by its own rule.

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
    if outcome.verdict == Verdict.NOT_TESTABLE:
        return outcome
    fewest = min(evidence.test_paths.values(), default=FEWEST_PATHS)
    if fewest < FEWEST_PATHS and outcome.verdict != Verdict.UNDECIDED:
        reason = f"a test set has {fewest} paths, fewer than {FEWEST_PATHS}; {outcome.reason}"
        return replace(outcome, verdict=Verdict.UNDECIDED, reason=reason)
    return outcome
