"""Do the localizers localize at all? Checks that need nothing published, and presume no outcome."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from synfeal.report.cells import Cell
from synfeal.report.layouts import TITLES, scene_title


@dataclass(frozen=True)
class SceneCheck:
    """What Table 4 says about one scene; errors are against the true poses.

    Attributes:
        scene: its name.
        smallest: the smallest size, by training frames.
        largest: the largest size.
        baseline_m: error of always answering the mean training position, at the largest size.
        position_m: error of each localizer at the largest size; None when its runs failed.
        position_falls: whether each localizer's position error is lower at the largest size than at
            the smallest; None when either is missing.
        orientation_falls: the same of the orientation error.
    """

    scene: str
    smallest: str
    largest: str
    baseline_m: float | None
    position_m: dict[str, float | None]
    position_falls: dict[str, bool | None]
    orientation_falls: dict[str, bool | None]


def check_scenes(cells: Sequence[Cell]) -> list[SceneCheck]:
    """Check every scene of Table 4's cells."""
    scenes = dict.fromkeys(cell.row.scene for cell in cells)
    return [_check([cell for cell in cells if cell.row.scene == scene]) for scene in scenes]


def sentences(check: SceneCheck) -> list[str]:
    """The findings of one scene in plain words."""
    where = f"{scene_title(check.scene)}, {check.largest}"
    lines = [f"{where}: the mean-pose baseline could not be computed."]
    if check.baseline_m is not None:
        half = check.baseline_m / 2
        below = [m for m, e in check.position_m.items() if e is not None and e < half]
        lines = [
            f"{where}: {len(below)} of {len(check.position_m)} localizers have a median position "
            f"error below half of the mean-pose baseline ({half:.2f} m): {_errors(check)}."
        ]
    if check.smallest == check.largest:
        return lines
    step = f"{scene_title(check.scene)}, {check.smallest} to {check.largest}"
    position, orientation = _falls(check.position_falls), _falls(check.orientation_falls)
    return [
        *lines,
        f"{step}: the position error falls for {position}, the orientation error for "
        f"{orientation}.",
    ]


def _check(cells: Sequence[Cell]) -> SceneCheck:
    sizes = {cell.row.size: cell.own.n_train for cell in cells}
    smallest, largest = min(sizes, key=sizes.__getitem__), max(sizes, key=sizes.__getitem__)
    first = {cell.model: cell for cell in cells if cell.row.size == smallest}
    last = {cell.model: cell for cell in cells if cell.row.size == largest}
    return SceneCheck(
        scene=cells[0].row.scene,
        smallest=smallest,
        largest=largest,
        baseline_m=next(iter(last.values())).own.references["baseline_position_m_true"],
        position_m={model: _error(cell, "position_m_true") for model, cell in last.items()},
        position_falls={m: _fall(first[m], last[m], "position_m_true") for m in last},
        orientation_falls={m: _fall(first[m], last[m], "orientation_deg_true") for m in last},
    )


def _error(cell: Cell, measure: str) -> float | None:
    return cell.own.scores[measure].value


def _fall(first: Cell, last: Cell, measure: str) -> bool | None:
    before, after = _error(first, measure), _error(last, measure)
    return None if before is None or after is None else after < before


def _errors(check: SceneCheck) -> str:
    texts = {m: "failed" if e is None else f"{e:.2f} m" for m, e in check.position_m.items()}
    return ", ".join(f"{TITLES[model]} {text}" for model, text in texts.items())


def _falls(falls: dict[str, bool | None]) -> str:
    others = [TITLES[model] for model, falling in falls.items() if not falling]
    exceptions = f" (not {', '.join(others)})" if others else ""
    return f"{len(falls) - len(others)} of {len(falls)}{exceptions}"
