"""Tables of the profile ``real``, from poses of photographs to the numbers of figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.real.config import RealConfig
from reproduction.real.design import (
    GIVEN,
    PHOTOGRAPHS,
    RANDOMISED,
    REFINED,
    RENDERED,
    Part,
    RealDesign,
    RealRun,
    design_of,
    folder,
)
from reproduction.real.scores import (
    Draws,
    Errors,
    Truth,
    cell,
    correlation_frames,
    median_of,
    read_errors,
    read_truth,
    times_as_exact,
)
from reproduction.tables.columns import write_side
from reproduction.tables.real import AMOUNT, COVER, RUNS, SCHEMA, side_layout
from synfeal.records.files import read_json
from synfeal.records.tables import NUMBER, frame_of, read_frame, write_frame

STRUCTURE, STRUCTURE_REFINED = "structure", "structure-refined"
REFERENCES = ("retrieval", "nearest", "mean")
# Shares of a photograph that the scan covers: bounds of the bins that errors are shown for.
SHARE_BOUNDS = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0)


class Scored:
    """Labels, draws and errors of one part, by both sources of labels.

    Args:
        config: The profile.
        part: Whose photographs are localized.
    """

    def __init__(self, config: RealConfig, part: Part) -> None:
        self.part, self._config = part, config
        at = folder(config, part)
        self.truth: Truth = read_truth(at / "truth_given.csv")
        self._sfm = read_truth(at / "truth_sfm.csv") if config.sfm_labels else None
        self.draws = Draws(self.truth.names, config.block_frames)
        self.fused = int(read_json(at / "scan.json")["frames"]["fused"])

    def errors(self, poses: Sequence[str]) -> list[Errors]:
        """Compute errors of runs, by their poses below the results, against the given labels."""
        return [read_errors(self._config.results / path, self.truth) for path in poses]

    def by_sfm(self, poses: Sequence[str]) -> list[Errors]:
        """Compute the same against the labels by SfM; none where there are none."""
        if self._sfm is None:
            return []
        return [read_errors(self._config.results / path, self._sfm) for path in poses]

    def cell(self, poses: Sequence[str]) -> dict[str, Any]:
        """Score a localizer on the part: the numbers of one row of the table.

        Args:
            poses: Its poses of the photographs, a file for each seed, below the results.

        Returns:
            Errors and shares with their limits (:func:`reproduction.real.scores.cell`), against
            the given labels and, under names that end in ``_sfm``, against those of SfM; counts of
            photographs tested, of blocks drawn and of frames fused.
        """
        runs, others = self.errors(poses), self.by_sfm(poses)
        found: dict[str, Any] = cell(runs, self.draws)
        if others:
            found |= {f"{key}_sfm": value for key, value in cell(others, self.draws).items()}
        return {
            **found,
            "n_test": len(self.truth),
            "n_blocks": self.draws.n_blocks,
            "correlation_frames": correlation_frames(runs),
            "n_fused": self.fused,
        }


def write_real_tables(
    config: RealConfig,
    out_table: Path,
    out_tex: Path,
    out_runs: Path,
    out_amount: Path,
    out_cover: Path,
) -> None:
    """Score all poses and write the table, its LaTeX, and what the figures show.

    Args:
        config: The profile.
        out_table: A line for each direction, source of labels, training and localizer.
        out_tex: The table for a paper.
        out_runs: Median errors of every training run by itself, against the sequence's own labels.
        out_amount: Errors against the number of rendered frames, and of photographs.
        out_cover: Errors against the share of a photograph that the scan covers.
    """
    design = design_of(config)
    scored = {part: Scored(config, part) for part in design.parts}
    rows = [row for part in design.parts for row in _rows(config, design, scored[part])]
    table = frame_of(rows, SCHEMA)
    write_frame(out_table, table)
    write_side(out_tex, side_layout(table))
    write_frame(out_runs, frame_of(_runs(config, design, scored), RUNS))
    write_frame(out_amount, frame_of(_amounts(config, design), AMOUNT))
    write_frame(out_cover, frame_of(_covers(config, design, scored), COVER))


def _rows(config: RealConfig, design: RealDesign, scored: Scored) -> Iterator[dict[str, Any]]:
    part = scored.part
    of_part = [run for run in design.runs if run.part == part]
    keys = dict.fromkeys((run.row, run.localizer) for run in of_part)
    for row, localizer in keys:
        poses = _poses(run for run in of_part if (run.row, run.localizer) == (row, localizer))
        yield {
            **_labelled(config, part, row, localizer),
            "images": config.images,
            **scored.cell(poses),
            **_against_photographs(scored, of_part, row, localizer, poses),
        }
    for place in (place for place in design.maps if place.part == part):
        found = scored.cell([f"{place.directory}/poses.csv"])
        of, method = (RENDERED, STRUCTURE_REFINED) if place.of == REFINED else (place.of, STRUCTURE)
        yield {**_labelled(config, part, of, method), **found}
    for name in REFERENCES:
        found = scored.cell([f"{part.name}/references/{name}.csv"])
        trained_on = PHOTOGRAPHS if name == "mean" else "rendered"
        yield {**_labelled(config, part, trained_on, name), **found}


def _runs(
    config: RealConfig, design: RealDesign, scored: dict[Part, Scored]
) -> Iterator[dict[str, Any]]:
    """Yield the median errors of each training run, against the sequence's own labels."""
    for run in design.runs:
        (errors,) = scored[run.part].errors(_poses([run]))
        keys = _labelled(config, run.part, run.row, run.localizer)
        yield {
            **{key: keys[key] for key in keys if key in RUNS},
            "seed": run.seed,
            "position_m": float(np.median(errors.position_m)),
            "orientation_deg": float(np.median(errors.orientation_deg)),
        }


def _labelled(config: RealConfig, part: Part, row: str, method: str) -> dict[str, Any]:
    return {
        "scene": config.scene,
        "direction": part.direction,
        "labels": part.labels,
        "trained_on": row,
        "method": method,
    }


def _poses(runs: Any) -> list[str]:
    return [f"{run.directory}/poses.csv" for run in runs]


def _against_photographs(
    scored: Scored, of_part: Sequence[RealRun], row: str, localizer: str, poses: Sequence[str]
) -> dict[str, float]:
    others = [run for run in of_part if (run.row, run.localizer) == (PHOTOGRAPHS, localizer)]
    if row == PHOTOGRAPHS or len(others) != len(poses):
        return {}
    runs, photographs = scored.errors(poses), scored.errors(_poses(others))
    return times_as_exact(runs, photographs, scored.draws)


def _amounts(config: RealConfig, design: RealDesign) -> Iterator[dict[str, Any]]:
    """Yield the points of the figure: of PoseNet2, in the main direction."""
    main = Part(design.main)
    if main not in design.parts:
        return
    scored = Scored(config, main)
    in_table = [run for run in design.runs if run.part == main and run.localizer == "posenet2"]
    randomised = [run for run in in_table if run.row == RANDOMISED]
    for run in design.fewer_frames:
        yield _amount("frames", RANDOMISED, run.frames, scored, [run])
    if randomised:
        yield _amount("frames", RANDOMISED, config.frames, scored, randomised)
    on_photographs = [run for run in in_table if run.row == PHOTOGRAPHS]
    scanned = len(_names(config, main))
    if on_photographs:
        yield _amount("photographs", PHOTOGRAPHS, scanned, scored, on_photographs)
    same = [r for r in design.fewer_frames if r.frames == config.curve_photographs_frames]
    if same:
        yield _amount("photographs", RANDOMISED, scored.fused, scored, same)
    for part, runs in groupby(design.fewer_photographs, key=lambda run: run.part):
        of_part = Scored(config, part)
        for run in runs:
            yield _amount("photographs", run.row, of_part.fused, of_part, [run])


def _names(config: RealConfig, part: Part) -> list[Path]:
    return sorted(folder(config, part).glob("train/seq-*/*.pose.txt"))


def _amount(
    kind: str, row: str, amount: int | None, scored: Scored, runs: Sequence[RealRun]
) -> dict[str, Any]:
    errors = scored.errors(_poses(runs))
    return {
        "kind": kind,
        "trained_on": row,
        "amount": amount,
        "n_seeds": len(runs),
        **median_of("position_m", [e.position_m for e in errors], scored.draws),
        **median_of("orientation_deg", [e.orientation_deg for e in errors], scored.draws),
    }


def _covers(
    config: RealConfig, design: RealDesign, scored: dict[Part, Scored]
) -> Iterator[dict[str, Any]]:
    """Yield median errors of photographs by the share of them that the scan covers."""
    for part in (part for part in design.parts if part.labels == GIVEN):
        shares = read_cover(folder(config, part) / "cover.csv")
        bins = np.digitize(shares, SHARE_BOUNDS[1:-1])
        runs = [run for run in design.runs if run.part == part and run.localizer == "posenet2"]
        for row in dict.fromkeys(run.row for run in runs):
            errors = scored[part].errors(_poses(run for run in runs if run.row == row))
            for index in np.unique(bins):
                yield _bin(part, row, int(index), bins == index, shares, errors)


def _bin(
    part: Part,
    row: str,
    index: int,
    there: NDArray[np.bool_],
    shares: NDArray[np.float64],
    errors: Sequence[Errors],
) -> dict[str, Any]:
    positions = np.array([run.position_m[there] for run in errors])
    angles = np.array([run.orientation_deg[there] for run in errors])
    return {
        "direction": part.direction,
        "trained_on": row,
        "share_low": SHARE_BOUNDS[index],
        "share_high": SHARE_BOUNDS[index + 1],
        "share": float(shares[there].mean()),
        "n_test": int(there.sum()),
        "position_m": float(np.median(positions, axis=1).mean()),
        "orientation_deg": float(np.median(angles, axis=1).mean()),
    }


def read_cover(path: Path) -> NDArray[np.float64]:
    """Read the shares (N,) of the photographs that the scan covers, 0 to 1."""
    return np.asarray(read_frame(path, {"covered": NUMBER}).covered, np.float64)
