"""Effects and verdicts of a single run.

Limits are over the run's test paths and over training runs; a single training run is taken to vary
as those of the published runs did (:mod:`reproduction.statistics.seeds`). They say nothing of other
rooms, paths and label sets: that takes replications (:mod:`reproduction.replications`).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from pydantic import BaseModel, Field

from baselines.config.learning import MODELS
from reproduction.claims.effects import (
    ABOUT_LABELS,
    ABOUT_TRAINING,
    DESCRIBED,
    RIVALS,
    SIZES,
    Against,
    Effect,
)
from reproduction.claims.evidence import COMMON, Cell, Evidence, Missing, evidence_of
from reproduction.claims.judge import (
    Condition,
    Limits,
    condition_of,
    judge_claim,
    judge_few,
    judge_many,
    percent,
    reached,
)
from reproduction.claims.tables import (
    PERCENT,
    RATE,
    SHARE,
    THIS_RUN,
    Keys,
    Row,
    write_claims,
)
from reproduction.claims.verdicts import Verdict, published_claims
from reproduction.design.experiments import Design
from reproduction.runs.results import read_result
from reproduction.statistics.limits import share_limits
from reproduction.statistics.seeds import limits
from reproduction.tables.assistance import (
    PUBLISHED_ASSISTED,
    PUBLISHED_BATCHES,
    PUBLISHED_SCENE,
    assistance_record,
)
from synfeal.evaluation.bootstrap import CONFIDENCE, FEWEST_PATHS, Array

KINECT_FUSION = "kinect-fusion"
# Distance of frames as published; at twice that most batches of the Large Room lose the camera:
# frame-to-model tracking starts at the pose before and reaches a few centimetres.
PAPERS_SPACING_M, FARTHEST_M = 0.03, 0.04
# What no run can decide, and why.
NOT_JUDGED = {
    "C9": (Verdict.NOT_TESTABLE, "metres and degrees of other rooms, cameras and networks"),
    "C16": (
        Verdict.BY_CONSTRUCTION,
        "the stand-in rooms are built to the volumes of Table 1, so that nothing is found out",
    ),
}


def _cells(*models: str, scene: str = "large_room", sizes: tuple[str, ...] = ("6k",)) -> list[Cell]:
    return [Cell(model, scene, one) for one in sizes for model in models or MODELS]


# What has to have learnt from true labels before a claim about localizers says anything.
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


def write_run_claims(design: Design, root: Path) -> None:
    """Write the effects of a run, and its verdict on each claim.

    Args:
        design: The profile's table of experiments.
        root: Results of the profile.
    """
    found = claims_of_run(evidence_of(design, root))
    write_claims(root, found.rows, found.verdicts, 1, found.reasons)


@dataclass(frozen=True)
class RunClaims:
    """Rows of effects of a run, its verdicts on the claims, and reasons for some."""

    rows: list[Row] = field(default_factory=list)
    verdicts: dict[Keys, Verdict] = field(default_factory=dict)
    reasons: dict[Keys, str] = field(default_factory=dict)

    def untested(self, keys: Keys, reason: str) -> None:
        """Note that the run cannot judge a claim."""
        self.verdicts[keys] = Verdict.NOT_TESTABLE
        self.reasons[keys] = reason


def claims_of_run(evidence: Evidence) -> RunClaims:
    """Judge every claim that the run's profile has rows for."""
    found = RunClaims()
    against: Against
    for claim in ABOUT_LABELS:
        for against in ("labels", "true"):
            _judge_errors(found, evidence, claim, against)
    for claim in ABOUT_TRAINING:
        _judge_errors(found, evidence, claim, "true")
    for claim, judge_one in (("C4", _judge_few), ("C14", _judge_rate), ("C15", _judge_many)):
        try:
            judge_one(found, evidence)
        except Missing as missing:
            found.untested((claim, ""), str(missing))
    for claim, (verdict, reason) in NOT_JUDGED.items():
        found.verdicts[claim, ""], found.reasons[claim, ""] = verdict, reason
    return found


@dataclass(frozen=True)
class RunErrors:
    """Errors of a run: a source of effects, whose samples are laid out over paths and runs."""

    evidence: Evidence

    def log_errors(self, cell: Cell, test_set: str, against: Against) -> Array:
        """Sample logarithms of both median errors; the evidence has the score that is asked for."""
        (errors,) = self.evidence.errors(cell)
        with np.errstate(divide="ignore"):
            logs: Array = np.log(errors)
        return logs


def _judge_errors(found: RunClaims, evidence: Evidence, claim: str, against: Against) -> None:
    """Judge a claim about localizers; describe what no claim is about."""
    about_labels = claim in ABOUT_LABELS
    own = evidence.under(against if about_labels else COMMON)
    effects = (ABOUT_LABELS if about_labels else ABOUT_TRAINING)[claim]
    keys = claim, against
    try:
        with np.errstate(invalid="ignore"):
            asserted = list(effects(RunErrors(own), against))
        unlearnt = own.not_learnt(LEARNT.get(claim, []))
    except Missing as missing:
        if claim not in DESCRIBED:
            found.untested(keys, str(missing))
        return
    parts = defaultdict[str, list[Condition]](list)
    for effect in asserted:
        of_sample = partial(limits, effect.sample, own.layout)
        condition = condition_of(effect, of_sample)
        parts[effect.part].append(condition)
        found.rows.append(_effect_row(effect, of_sample(), condition.printed))
    if claim in DESCRIBED:
        return
    verdict = judge_claim(claim, parts)
    fewest = min(own.test_paths.values())
    if unlearnt:
        more = f" and {len(unlearnt) - 1} more" if len(unlearnt) > 1 else ""
        verdict, found.reasons[keys] = Verdict.NOT_LEARNT, f"{unlearnt[0]}{more}"
    elif fewest < FEWEST_PATHS and verdict != Verdict.UNDECIDED:
        found.reasons[keys] = f"a test set has {fewest} paths, fewer than {FEWEST_PATHS}"
        verdict = Verdict.UNDECIDED
    found.verdicts[keys] = verdict


def _effect_row(effect: Effect, ends: tuple[float, float], printed: float) -> Row:
    return {
        **dict(zip(("claim", "part", "quantity", "against"), effect[:4], strict=True)),
        "replication": THIS_RUN,
        "value": percent(float(effect.sample[0])),
        "low": percent(ends[0]),
        "high": percent(ends[1]),
        "printed": percent(printed),
        "unit": PERCENT,
    }


def _judge_few(found: RunClaims, evidence: Evidence) -> None:
    """Judge C4 in the Large Room, as the paper's batches are of that room."""
    counts = {method: _assisted(evidence, method)[PUBLISHED_SCENE] for method in RIVALS}
    for method, count in counts.items():
        printed = PUBLISHED_ASSISTED[method] / PUBLISHED_BATCHES
        found.rows.append(_share_row("C4", method, count, printed))
    found.verdicts["C4", ""] = judge_few({m: _share_of(count) for m, count in counts.items()})


def _judge_many(found: RunClaims, evidence: Evidence) -> None:
    """Judge C15 in all scenes.

    They have equally many batches, so that the binomial limits of all batches together are no
    narrower than those of a stratified sample.
    """
    by_scene = _assisted(evidence, KINECT_FUSION)
    poses = evidence.under("true").test_set("large_room", "6k").poses
    steps_m = np.linalg.norm(np.diff(poses.position_m, axis=0), axis=1)
    spacing_m = float(np.median(steps_m[np.diff(poses.path) == 0]))
    if spacing_m > FARTHEST_M:
        raise Missing(
            f"frames are {100 * spacing_m:.0f} cm apart, and tracking is asked of frames"
            f" {100 * PAPERS_SPACING_M:.0f} cm apart"
        )
    assisted, batches = (sum(counts) for counts in zip(*by_scene.values(), strict=True))
    found.rows.append(_share_row("C15", KINECT_FUSION, (assisted, batches), math.nan))
    found.verdicts["C15", ""] = judge_many(_share_of((assisted, batches)))


def _assisted(evidence: Evidence, method: str) -> dict[str, tuple[int, int]]:
    """Count by scene how many batches were assisted, of how many."""
    evidence.need(scene="large_room", size="6k", labels=method)
    counts = {}
    for scene in [s for s, *names in evidence.estimated if names == ["6k", method]]:
        evidence.file(f"labels/{scene}/6k/{method}/assistance.json")
        record = assistance_record(evidence.root, scene, "6k", method)
        counts[scene] = int(record["assisted"]), int(record["batches"])
    return counts


def _share_of(count: tuple[int, int]) -> Limits:
    """Return exact limits of a share, by the number of shares it is one of."""
    return lambda comparisons: share_limits(*count, 1 - (1 - CONFIDENCE) / comparisons)


def _share_row(claim: str, method: str, count: tuple[int, int], printed: float) -> Row:
    low, high = share_limits(*count)
    same = {"claim": claim, "part": method, "quantity": "batches assisted", "against": ""}
    ends = {"value": count[0] / count[1], "low": low, "high": high, "printed": printed}
    return {**same, "replication": THIS_RUN, **ends, "unit": SHARE}


class _Speed(BaseModel):
    width: int
    height: int
    frames_per_s: list[float] = Field(min_length=1)
    processor: str
    cores: int


def _judge_rate(found: RunClaims, evidence: Evidence) -> None:
    """Judge C14: every part of a collection of either scene reaches the printed rate."""
    (claim,) = [claim for claim in published_claims() if claim.id == "C14"]
    verdicts, rows, machines = [], [], []
    for scene in SIZES:
        evidence.need(scene=scene)
        path = evidence.file(f"scenes/{scene}/collection_speed.json")
        speed: _Speed = read_result(path, (), "measure it again", _Speed)
        rates = speed.frames_per_s
        verdicts.append(reached(min(rates), max(rates), claim.numbers[0]))
        mean = len(rates) / sum(1 / rate for rate in rates)
        same = {"claim": "C14", "part": scene, "quantity": "collection", "against": ""}
        ends = {"value": mean, "low": min(rates), "high": max(rates), "printed": claim.numbers[0]}
        rows.append({**same, "replication": THIS_RUN, **ends, "unit": RATE})
        machines.append(f"{speed.processor}, {speed.cores} usable cores")
    found.rows.extend(rows)
    found.verdicts["C14", ""] = verdicts[0] if len(set(verdicts)) == 1 else Verdict.MIXED
    found.reasons["C14", ""] = (
        f"slowest to fastest part, on {', '.join(dict.fromkeys(machines))}; the paper's is a laptop"
        " with an Intel i7-1065G7 and an NVIDIA GeForce MX350"
    )
