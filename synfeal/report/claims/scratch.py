"""Section 4.4: training from scratch against transfer learning."""

from __future__ import annotations

from itertools import product

import numpy as np

from synfeal.bootstrap import limits, mean_of, relative_change
from synfeal.config import MODELS
from synfeal.report.claims.evidence import QUANTITIES, Cell, Errors, Evidence
from synfeal.report.claims.label_sources import changes
from synfeal.report.claims.model import Claim, Outcome
from synfeal.report.claims.size import SIZES, in_print
from synfeal.report.claims.text import ERRORS, limits_text, values_text
from synfeal.report.claims.verdicts import Condition, all_of, at_least
from synfeal.report.layouts import TITLES

INITS = {"pretrained": "transfer learning", "scratch": "from scratch"}
SCENE = "large_room"


def worse_when_small(claim: Claim, evidence: Evidence) -> Outcome:
    """C10: the changes from transfer learning to scratch are above 0 at the two smallest sizes."""
    by_size = {size: _changes(evidence, size) for size in ("6k", "20k")}
    found = [change for cells in by_size.values() for cell in cells for change in cell]
    verdict, reason = all_of(
        [
            Condition(f"{size} {name}", mean_of(sample))
            for size, cells in by_size.items()
            for name, sample in zip(QUANTITIES, zip(*cells, strict=True), strict=True)
        ],
        each=[
            Condition(f"{TITLES[model]} {size} {name}", change)
            for (size, model, name), change in zip(
                product(by_size, MODELS, QUANTITIES), found, strict=True
            )
        ],
    )
    worse = np.sum([change > 0 for change in found], axis=0).astype(float)
    low, high = limits(worse)
    measured = f"{worse[0]:.0f} of {len(found)} worse from scratch"
    return Outcome(verdict, measured, f"{low:.0f} to {high:.0f}", reason)


def better_when_large(claim: Claim, evidence: Evidence) -> Outcome:
    """C11: at least three localizers are better from scratch, in both errors, at 80k."""
    found = {model: _change(evidence, model, "80k") for model in MODELS}
    better = {model: (p < 0) & (o < 0) for model, (p, o) in found.items()}
    count = np.sum(list(better.values()), axis=0).astype(float)
    low, high = limits(count)
    which = [TITLES[model] for model, flags in better.items() if flags[0]]
    measured = f"{count[0]:.0f} of {len(MODELS)}" + (f" ({', '.join(which)})" if which else "")
    verdict = at_least(count, claim.numbers[0])
    return Outcome(verdict, measured, f"{low:.0f} to {high:.0f}", "compared with 3 of 5")


def best_of_all(claim: Claim, evidence: Evidence) -> Outcome:
    """C12: PoseNet2 from scratch at 80k has a lower position error than every other cell."""
    claimed = Cell("posenet2", SCENE, "80k", init="scratch")
    cells = [Cell(m, SCENE, size, init=i) for i in INITS for size in SIZES[SCENE] for m in MODELS]
    errors = {cell: evidence.errors(cell) for cell in cells}
    own = errors[claimed]
    others = [found.position for cell, found in errors.items() if cell != claimed]
    gains = [-relative_change(own.position, other) for other in others]
    verdict, reason = all_of([Condition("", gain, smallest=0.0) for gain in gains])
    lowest = [min(errors, key=lambda cell: float(errors[cell][which][0])) for which in range(2)]
    best = [
        f"lowest {name}: {_name(cell)} {values_text(ERRORS, in_print(errors[cell]))}"
        for name, cell in zip(("position", "orientation"), lowest, strict=True)
    ]
    measured = "; ".join([values_text(ERRORS, in_print(own)), *best])
    return Outcome(verdict, measured, limits_text(ERRORS, in_print(own)), reason)


def _changes(evidence: Evidence, size: str) -> list[Errors]:
    return [_change(evidence, model, size) for model in MODELS]


def _change(evidence: Evidence, model: str, size: str) -> Errors:
    scratch = Cell(model, SCENE, size, init="scratch")
    return changes(evidence, scratch, scratch._replace(init="pretrained"))


def _name(cell: Cell) -> str:
    return f"{TITLES[cell.model]}, {INITS[cell.init]}, {cell.size},"
