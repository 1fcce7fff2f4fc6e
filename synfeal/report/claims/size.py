"""Section 4.3: the size of the data set."""

from __future__ import annotations

from synfeal.bootstrap import mean_of, relative_change
from synfeal.config import MODELS
from synfeal.report.claims.evidence import Cell, Errors, Evidence
from synfeal.report.claims.model import Claim, Outcome
from synfeal.report.claims.text import ERRORS, PERCENT, limits_text, reached_text, values_text
from synfeal.report.claims.verdicts import all_of, near, reaches
from synfeal.report.layouts import TITLES
from synfeal.report.stats import kendall_tau

# Table 4, in order of size.
SIZES = {
    "large_room": ("6k", "20k", "40k", "80k"),
    "sanctuary": ("6k", "20k", "40k", "95k"),
}


def large_room_grows(claim: Claim, evidence: Evidence) -> Outcome:
    """C7: the errors fall by the published share, or by more, mean over the localizers."""
    return _grows(claim, evidence, "large_room")


def sanctuary_grows(claim: Claim, evidence: Evidence) -> Outcome:
    """C8: as C7."""
    return _grows(claim, evidence, "sanctuary")


def sanctuary_at_6k(claim: Claim, evidence: Evidence) -> Outcome:
    """C9: mean errors over the localizers within 20 % of the published ones."""
    cells = [evidence.errors(Cell(model, "sanctuary", "6k")) for model in MODELS]
    means = [mean_of([cell[which] for cell in cells]) for which in range(2)]
    parts = [near(mean, number, 2) for mean, number in zip(means, claim.numbers, strict=True)]
    words = {"holds": "within 20 %", "does not hold": "not within 20 %"}
    position, orientation = (words.get(part, "undecided") for part in parts)
    reason = f"position {position}, orientation {orientation}"
    return Outcome(all_of(parts), values_text(ERRORS, means), limits_text(ERRORS, means), reason)


def _grows(claim: Claim, evidence: Evidence, scene: str) -> Outcome:
    series = {
        model: [evidence.errors(Cell(model, scene, size)) for size in SIZES[scene]]
        for model in MODELS
    }
    means = [
        mean_of([relative_change(cells[-1][which], cells[0][which]) for cells in series.values()])
        for which in range(2)
    ]
    parts = [reaches(mean, number, 2) for mean, number in zip(means, claim.numbers, strict=True)]
    taus = [_tau_text(model, cells) for model, cells in series.items()]
    measured = f"{values_text(PERCENT, means)}; tau p/o: {', '.join(taus)}"
    return Outcome(
        all_of(parts), measured, limits_text(PERCENT, means), reached_text(means, claim, parts)
    )


def _tau_text(model: str, cells: list[Errors]) -> str:
    position, orientation = (
        kendall_tau(range(len(cells)), [float(cell[which][0]) for cell in cells])
        for which in range(2)
    )
    return f"{TITLES[model]} {position:+.2f}/{orientation:+.2f}"
