"""Errors of localized photographs, and medians with limits over blocks of neighbours and seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reproduction.real.split import blocks_of, full_name
from reproduction.statistics.seeds import Group, Layout, limits
from synfeal.dataset.pose_table import IMAGE, read_pose_table
from synfeal.dataset.poses_in import read_pose_list
from synfeal.errors import InputError
from synfeal.evaluation.bootstrap import Counts, medians, path_counts
from synfeal.evaluation.metrics import means
from synfeal.geometry.poses import pose_error
from synfeal.records.provenance import generator_of
from synfeal.records.tables import TEXT, read_frame

Array = NDArray[np.float64]
RECALL_M, RECALL_DEG = 0.05, 5.0


@dataclass(frozen=True)
class Truth:
    """Labels of the photographs that are localized.

    Attributes:
        names: Names of the photographs, such as ``seq-01/frame-000500``.
        world_from_cam: Poses (N, 4, 4).
    """

    names: tuple[str, ...]
    world_from_cam: Array

    def __len__(self) -> int:
        return len(self.names)


def read_truth(path: Path) -> Truth:
    """Read labels of photographs and their names."""
    names = read_frame(path, {IMAGE: TEXT})[IMAGE]
    return Truth(tuple(names), read_pose_table(path).world_from_cam)


def photograph_name(image: str) -> str:
    """Name a photograph by its file: ``seq-01/frame-000500`` of ``…/….color.png``."""
    path = Path(image)
    return full_name(path.name.partition(".")[0], path.parent.name)


@dataclass(frozen=True)
class Errors:
    """Errors (N,) of one run, infinite where a photograph was not localized."""

    position_m: Array
    orientation_deg: Array

    @property
    def recalled(self) -> Array:
        """1 where a photograph (N,) is localized within 5 cm and 5 degrees, else 0."""
        good = (self.position_m < RECALL_M) & (self.orientation_deg < RECALL_DEG)
        return good.astype(np.float64)

    @property
    def localized(self) -> Array:
        """1 where there is a pose (N,), else 0."""
        return np.isfinite(self.position_m).astype(np.float64)


def read_errors(poses: Path, truth: Truth) -> Errors:
    """Score poses of ``synfeal localize``.

    Raises:
        InputError: The file cannot be read, or lacks a photograph.
    """
    estimates = read_pose_list(poses)
    found = estimates.world_from_cam(estimates.convention)
    row = {photograph_name(name): i for i, name in enumerate(estimates.names)}
    lost = [name for name in truth.names if name not in row]
    if lost:
        raise InputError(poses, f"has no line for {lost[0]}", "localize all photographs again")
    world_from_cam = found[[row[name] for name in truth.names]]
    good = np.asarray(np.isfinite(world_from_cam).all(axis=(1, 2)))
    position_m, orientation_deg = np.full(len(good), np.inf), np.full(len(good), np.inf)
    errors = pose_error(world_from_cam[good], truth.world_from_cam[good])
    position_m[good], orientation_deg[good] = errors[0], np.degrees(errors[1])
    return Errors(position_m, orientation_deg)


class Draws:
    """One set of draws for all that is tested on the same photographs, so differences are paired.

    Args:
        names: Names of the photographs, by which neighbours are found; blocks of them are drawn.
        block_frames: How many neighbours a block has.
    """

    def __init__(self, names: Sequence[str], block_frames: int) -> None:
        self.place = blocks_of(names, block_frames)
        self.n_blocks = int(self.place.max()) + 1
        self.counts: Counts = path_counts(self.n_blocks, generator_of("real", len(names)))

    def medians(self, runs: Sequence[Array]) -> list[Array]:
        """Return the median (1 + resamples,) of each run's errors (N,): observed, then drawn."""
        return [medians(errors, self.place, self.counts) for errors in runs]

    def means(self, runs: Sequence[Array]) -> list[Array]:
        """Return the mean (1 + resamples,) of each run's values (N,): observed, then drawn."""
        return [np.asarray(means(values, self.place, self.counts)) for values in runs]


def samples_of(*results: Sequence[Array]) -> tuple[Layout, list[Array]]:
    """Lay out the samples of several results, each the mean of its runs.

    A result of a single run, such as a map's, has limits over blocks alone.

    Args:
        results: For each result, what each of its runs measured (1 + resamples,).
    """
    groups = tuple(Group(len(runs), len(runs) - 1.0) for runs in results if len(runs) > 1)
    layout = Layout(len(results[0][0]) - 1, groups)
    samples, place = [], 0
    for runs in results:
        if len(runs) > 1:
            samples.append(layout.sample(runs, place))
            place += 1
        else:
            samples.append(layout.constant(runs[0]))
    return layout, samples


def cell(runs: Sequence[Errors], draws: Draws) -> dict[str, float | int]:
    """Compute the numbers of a cell, each with its limits under ``_low`` and ``_high``."""
    measured = {
        "position_m": draws.medians([run.position_m for run in runs]),
        "orientation_deg": draws.medians([run.orientation_deg for run in runs]),
        "recall_5cm_5deg": draws.means([run.recalled for run in runs]),
        "localized": draws.means([run.localized for run in runs]),
    }
    found: dict[str, float | int] = {}
    for name, by_run in measured.items():
        layout, (sample,) = samples_of(by_run)
        found |= named(name, sample, layout)
    for share in ("recall_5cm_5deg", "localized"):
        found[f"{share}_low"] = max(found[f"{share}_low"], 0.0)
        found[f"{share}_high"] = min(found[f"{share}_high"], 1.0)
    return {
        **found,
        "position_m_worst": float(max(np.median(run.position_m) for run in runs)),
        "orientation_deg_worst": float(max(np.median(run.orientation_deg) for run in runs)),
        "n_seeds": len(runs),
    }


def median_of(name: str, runs: Sequence[Array], draws: Draws) -> dict[str, float]:
    """Compute the median error of some runs, averaged over them, with 95 % limits.

    Args:
        name: Column of the value; limits are under ``<name>_low`` and ``<name>_high``.
        runs: Errors (N,) of each run.
        draws: Draws of the photographs.
    """
    layout, (sample,) = samples_of(draws.medians(runs))
    return named(name, sample, layout)


def named(name: str, sample: Array, layout: Layout) -> dict[str, float]:
    """Name the value and the 95 % limits of a sample.

    Args:
        name: Column of the value; limits are under ``<name>_low`` and ``<name>_high``.
        sample: The sample (B,).
        layout: Its layout.
    """
    low, high = limits(sample, layout)
    return {name: float(sample[0]), f"{name}_low": low, f"{name}_high": high}


def times_as_exact(
    runs: Sequence[Errors], photographs: Sequence[Errors], draws: Draws
) -> dict[str, float]:
    """Compare runs with those of the same localizer trained on photographs, by the ratio of errors.

    Args:
        runs: Errors of the runs to judge.
        photographs: Errors, on the same photographs, of the runs trained on photographs.
        draws: Draws of the photographs.

    Returns:
        The ratios ``times_position`` and ``times_orientation``, above 1 where ``runs`` are more
        exact, with their 95 % limits under ``_low`` and ``_high``.
    """
    found: dict[str, float] = {}
    for measure in ("position_m", "orientation_deg"):
        layout, (trained, other) = samples_of(
            draws.medians([getattr(run, measure) for run in runs]),
            draws.medians([getattr(run, measure) for run in photographs]),
        )
        found |= named(f"times_{measure.partition('_')[0]}", other / trained, layout)
    return found


def correlation_frames(runs: Sequence[Errors]) -> float:
    """Estimate over how many neighbouring photographs errors stay alike (autocorrelation time).

    Of the logarithms of position errors, mean over runs, summed up to the first lag at which the
    correlation is not positive. Gaps between the photographs are passed over.
    """
    times = []
    for run in runs:
        log = np.log(np.maximum(run.position_m[np.isfinite(run.position_m)], 1e-6))
        centred = log - log.mean() if len(log) else log
        variance = float(np.square(centred).sum())
        time = 1.0
        for lag in range(1, len(centred) // 2):
            alike = float((centred[lag:] * centred[:-lag]).sum()) / max(variance, 1e-12)
            if alike <= 0:
                break
            time += 2 * alike
        times.append(time)
    return float(np.mean(times))
