"""Sections 4.3 and 4.4: the size of the data set, and training from scratch.

How long training takes is judged by the images that have to be shown for the same errors, for those
of two runs of one localizer cost the same. Runs are compared that were trained to their end, each
with its own course of the learning rate (Table 7): within one run most of the gain comes when the
rate falls, at the same place from whatever start, so that a history tells nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from baselines.config.learning import MODELS
from reproduction.claims.evidence import QUANTITIES, Cell, Evidence
from reproduction.claims.labels import changes, effects, every_localizer
from reproduction.claims.verdicts import (
    ERRORS,
    PERCENT,
    Claim,
    Condition,
    Outcome,
    Verdict,
    all_of,
    best_of,
    limits_text,
    values_text,
    verdict_of,
)
from reproduction.design.experiments import SHARES
from reproduction.statistics.limits import kendall_tau
from reproduction.statistics.seeds import limits
from reproduction.tables.layouts import STARTS, TITLES
from synfeal.evaluation.bootstrap import Array, mean_of, relative_change

SCENE = "large_room"
# Table 4, in order of size.
SIZES = {SCENE: ("6k", "20k", "40k", "80k"), "sanctuary": ("6k", "20k", "40k", "95k")}
# Shares of the images after which Table 7 has errors, by how `init` ends.
LENGTHS = {f"-{name}" if name else "": share for name, share in SHARES.items()}
# Errors are divided by this: the paper prints root mean squares over the axes, not distances.
IN_PRINT = np.array([[np.sqrt(3)], [1.0]])


def grows(claim: Claim, evidence: Evidence, scene: str) -> Outcome:
    """Judge C7 or C8: mean errors fall by two thirds of the published share, or more.

    Args:
        claim: The claim, which prints one change for position and one for orientation.
        evidence: Results to judge it by.
        scene: Room of the claim, a key of ``SIZES``; its largest set is compared with its smallest.
    """
    sizes = SIZES[scene]
    series = np.array([evidence.errors(*(Cell(m, scene, size) for size in sizes)) for m in MODELS])
    found = mean_of(list(relative_change(series[:, -1], series[:, 0])))
    outcome = effects(found, claim, evidence)
    taus = []
    for model, errors in zip(MODELS, series[..., 0], strict=True):
        position, orientation = (kendall_tau(range(len(sizes)), e.tolist()) for e in errors.T)
        taus.append(f"{TITLES[model]} {position:+.2f}/{orientation:+.2f}")
    return replace(outcome, measured=f"{outcome.measured}; tau p/o: {', '.join(taus)}")


def sanctuary_at_6k(claim: Claim, evidence: Evidence) -> Outcome:
    """Measure C9 without judging it: errors of another room, camera and network, metres."""
    cells = [Cell(model, "sanctuary", "6k") for model in MODELS]
    means = mean_of(list(evidence.errors(*cells) / IN_PRINT))
    shares = [float(mean[0]) / n for mean, n in zip(means, claim.numbers, strict=True)]
    texts = [
        f"{q} {100 * s:.0f} % of the published" for q, s in zip(QUANTITIES, shares, strict=True)
    ]
    reason = f"metres and degrees of other rooms and networks do not compare ({', '.join(texts)})"
    spans = limits_text(ERRORS, means, evidence.layout)
    return Outcome(Verdict.NOT_TESTABLE, values_text(ERRORS, means), spans, reason)


def worse_when_small(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C10: from scratch is worse than transfer learning at the two smallest sizes."""
    sizes = ("6k", "20k")
    found = np.array([_from_scratch(evidence, size) for size in sizes])
    judged = every_localizer(found, sizes, " ", evidence)
    worse = int((found[..., 0] > 0).sum())
    spans = [
        f"{size}: {limits_text(PERCENT, mean_of(list(part)), evidence.layout)}"
        for size, part in zip(sizes, found, strict=True)
    ]
    measured = f"{worse} of {found[..., 0].size} worse from scratch"
    return Outcome(judged.verdict, measured, "; ".join(spans), judged.reason, judged.turned)


def better_when_large(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C11: at least three localizers are better from scratch, in both errors, at 80k.

    Three are when the third best is: its smaller gain of both errors is above 0.
    """
    gains = -_from_scratch(evidence, "80k")
    which = [m for m, ends in zip(MODELS, gains[:, :, 0], strict=True) if ends.min() > 0]
    asked = int(claim.numbers[0])
    third = np.sort(gains.min(axis=1), axis=0)[-asked]
    names = f" ({', '.join(TITLES[model] for model in which)})" if which else ""
    verdict = verdict_of(Condition("", third, evidence.layout, is_order=True))
    low, high = limits(third, evidence.layout)
    interval = f"gain of number {asked}, the smaller of both errors: {low:+.1f} % to {high:+.1f} %"
    reason = f"compared with {asked} of {len(MODELS)}"
    return Outcome(verdict, f"{len(which)} of {len(MODELS)}{names}", interval, reason)


def best_of_all(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C12: PoseNet2 from scratch at 80k has the lowest position error of all cells."""
    claimed = Cell("posenet2", SCENE, "80k", init="scratch")
    cells = [Cell(m, SCENE, size, init=i) for i in STARTS for size in SIZES[SCENE] for m in MODELS]
    errors = evidence.errors(*cells)
    own = errors[cells.index(claimed)]
    others = np.delete(errors[:, 0], cells.index(claimed), axis=0)
    gains = -relative_change(own[0], others)
    rivals = [cell for cell in cells if cell != claimed]
    judged = best_of(
        [
            Condition(_name(rival), gain, evidence.layout)
            for rival, gain in zip(rivals, gains, strict=True)
        ]
    )
    best = []
    for name, found in zip(QUANTITIES, errors[:, :, 0].T, strict=True):
        place = int(np.argmin(found))
        printed = values_text(ERRORS, errors[place] / IN_PRINT)
        best.append(f"lowest {name}: {_name(cells[place])}, {printed}")
    measured = "; ".join([values_text(ERRORS, own / IN_PRINT), *best])
    spans = limits_text(ERRORS, own / IN_PRINT, evidence.layout)
    return Outcome(judged.verdict, measured, spans, judged.reason)


def longer(claim: Claim, evidence: Evidence) -> Outcome:
    """Judge C13: from scratch, more images have to be shown for the same errors, at 6k."""
    logs = np.array([_log_ratio(evidence, model) for model in MODELS])
    change = 100 * np.expm1(mean_of(list(logs)))
    low, high = limits(change, evidence.layout)
    judged = all_of(
        [Condition("images shown", change, evidence.layout, claim.numbers[0])],
    )
    each = [
        f"{TITLES[m]} {100 * np.expm1(log[0]):+.0f} %" for m, log in zip(MODELS, logs, strict=True)
    ]
    measured = f"{change[0]:+.0f} % images; {', '.join(each)}"
    interval = f"{low:+.0f} to {high:+.0f} %"
    return Outcome(judged.verdict, measured, interval, judged.reason, judged.turned)


def _log_ratio(evidence: Evidence, model: str) -> Array:
    """Sample the logarithm (1 + RESAMPLES,) of images from scratch over those with transfer."""
    old, new = (
        np.log(evidence.errors(*(Cell(model, init=f"{start}{end}") for end in LENGTHS)))
        for start in STARTS
    )
    return images_ratio(new.mean(axis=1), old.mean(axis=1))


def images_ratio(new: Array, old: Array) -> Array:
    """Measure the distance of two learning curves along the images, as a logarithm (B,).

    Errors fall about as a power of the images shown. Lines of one slope, the mean of both, are put
    through the logarithms of errors and images; not a number where they do not fall.

    Args:
        new: Logarithms (L, B) of the errors after each share of the images in ``LENGTHS``.
        old: The same of the runs that they are compared with.
    """
    images = np.log(list(LENGTHS.values()))
    images -= images.mean()
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = images @ (new + old) / 2 / (images @ images)
        return np.where(slope < 0, (new.mean(axis=0) - old.mean(axis=0)) / -slope, np.nan)


def _from_scratch(evidence: Evidence, size: str) -> Array:
    """Compute changes of the localizers (5, 2, ...) from transfer learning to scratch."""
    scratch = [Cell(model, SCENE, size, init="scratch") for model in MODELS]
    return changes(evidence, scratch, [cell._replace(init="pretrained") for cell in scratch])


def _name(cell: Cell) -> str:
    return f"{TITLES[cell.model]}, {STARTS[cell.init]}, {cell.size}"
