"""Section 4.3: the size of the data set."""

from __future__ import annotations

import math
from dataclasses import replace

from synfeal.bootstrap import limits, mean_of, relative_change
from synfeal.config import MODELS
from synfeal.report.claims.evidence import QUANTITIES, Cell, Errors, Evidence
from synfeal.report.claims.label_sources import effects
from synfeal.report.claims.model import HOLDS, OPPOSITE, UNDECIDED, Claim, Outcome, Verdict
from synfeal.report.claims.text import ERRORS, limits_text, values_text
from synfeal.report.layouts import TITLES
from synfeal.report.stats import kendall_tau

# Errors below this share of the published ones have been learnt further than the claim says.
NOT_YET = 0.8
# Table 4, in order of size.
SIZES = {
    "large_room": ("6k", "20k", "40k", "80k"),
    "sanctuary": ("6k", "20k", "40k", "95k"),
}


def large_room_grows(claim: Claim, evidence: Evidence) -> Outcome:
    """C7: the errors fall by two thirds of the published share, or more, mean of the localizers."""
    return _grows(claim, evidence, "large_room")


def sanctuary_grows(claim: Claim, evidence: Evidence) -> Outcome:
    """C8: as C7."""
    return _grows(claim, evidence, "sanctuary")


def sanctuary_at_6k(claim: Claim, evidence: Evidence) -> Outcome:
    """C9: mean errors, in the paper's unit, are no less than 80 % of the printed ones."""
    cells = [in_print(evidence.errors(Cell(model, "sanctuary", "6k"))) for model in MODELS]
    means = Errors(*(mean_of([cell[which] for cell in cells]) for which in range(2)))
    bounds = [NOT_YET * number for number in claim.numbers]
    spans = [limits(mean) for mean in means]
    verdict: Verdict = UNDECIDED
    if all(low >= bound for (low, _), bound in zip(spans, bounds, strict=True)):
        verdict = HOLDS
    elif any(high < bound for (_, high), bound in zip(spans, bounds, strict=True)):
        verdict = OPPOSITE
    shares = [float(mean[0]) / n for mean, n in zip(means, claim.numbers, strict=True)]
    texts = [
        f"{q} {100 * s:.0f} % of the published" for q, s in zip(QUANTITIES, shares, strict=True)
    ]
    measured = values_text(ERRORS, means)
    return Outcome(verdict, measured, limits_text(ERRORS, means), ", ".join(texts))


def in_print(errors: Errors) -> Errors:
    """Errors in the unit of the published ones: positions as root mean squares over the axes."""
    return errors._replace(position=errors.position / math.sqrt(3))


def _grows(claim: Claim, evidence: Evidence, scene: str) -> Outcome:
    series = {
        model: [evidence.errors(Cell(model, scene, size)) for size in SIZES[scene]]
        for model in MODELS
    }
    means = Errors(
        *(
            mean_of(
                [relative_change(cells[-1][which], cells[0][which]) for cells in series.values()]
            )
            for which in range(2)
        )
    )
    taus = [_tau_text(model, cells) for model, cells in series.items()]
    outcome = effects(means, claim)
    return replace(outcome, measured=f"{outcome.measured}; tau p/o: {', '.join(taus)}")


def _tau_text(model: str, cells: list[Errors]) -> str:
    position, orientation = (
        kendall_tau(range(len(cells)), [float(cell[which][0]) for cell in cells])
        for which in range(2)
    )
    return f"{TITLES[model]} {position:+.2f}/{orientation:+.2f}"
