"""How fast localizers are trained: this project's loop against a plain one over image files.

``python -m benchmarks.training_speed --results results/mini --frames DIR`` renders a few hundred
frames as files, trains on them in both ways, in turns, and compares speeds and losses. Both follow
the published protocol, in which frames are shown in the order of collection.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.training_case import Case, open_case, timed
from benchmarks.training_pages import CONFIG, OUT, write_page
from benchmarks.trainings import Row
from synfeal.config import load_config
from synfeal.errors import exit_status
from synfeal.files import atomic_path

SIZES = ((128, 96), (640, 480))
WORKERS = (0, 1)
ROUNDS, STEPS = 5, 10
# A row of the history is the loss of a single step where there are fewer than 100 of them.
COMPARED_STEPS = 40
# Weights that start so far off, the spacing of float32, show what rounding makes of a training.
NUDGE = 2.0**-23
# Adam makes steps of one size of gradients that are next to nothing, whose sign is rounding: at the
# profile's rate losses part soon, whatever the loop. A hundredth of it shows the loops.
RATES = (1.0, 0.01)
WAYS = {"ours": None, **{f"plain, {n} workers": n for n in WORKERS}}
COLUMNS = ("frames", "way", "samples_per_s", "samples_per_cpu_s", "cores", "rounds")


NOTES = """PoseNet2 in the profile's shape on 320 frames of the Large Room, the profile's batches,
one thread. `ours`: packed frames in memory, channels last, fused Adam. `plain`: a `Dataset` that
opens, decodes, resizes and crops a PNG file and reads a pose file for every item, a `DataLoader`,
NCHW, Adam that is not fused. Same network, initial weights, loss, rates and order of frames.
Medians of {rounds} rounds of {steps} steps in turns; files are in the system's cache. A worker is
a second process: `cores busy` is processor time over time. Packing takes {packing} a frame, once
for a data set, and nothing where frames are rendered into packed files.

Largest difference of the loss, over the mean size of the loss. The last column is what a change of
the initial weights by their rounding makes of our own loop: Adam amplifies it, so only what
exceeds it would tell the loops apart.

{losses}"""


def speeds(cases: dict[str, Case], rounds: int, steps: int) -> list[Row]:
    """Rows of the table: all ways in turns, once before they count; medians."""
    ways: dict[tuple[str, str], Callable[[], object]] = {
        (size, way): partial(case.ours, steps) if n is None else partial(case.plain, steps, n)
        for (size, case), (way, n) in product(cases.items(), WAYS.items())
    }
    taken = [[timed(way) for way in ways.values()] for _ in range(rounds + 1)][1:]
    rows = []
    for (size, way), (wall_s, cpu_s) in zip(ways, np.median(taken, axis=0).tolist(), strict=True):
        samples = cases[size].schedule(steps).samples_seen
        values = (samples / wall_s, samples / cpu_s, cpu_s / wall_s)
        cells = [size, way, *(f"{value:.4g}" for value in values), str(rounds)]
        rows.append(dict(zip(COLUMNS, cells, strict=True)))
    return rows


def largest_difference(first: Sequence[float], second: Sequence[float]) -> float:
    """Largest difference of two series of losses, over the mean size of the first."""
    a, b = np.array(first), np.array(second)
    return float(np.abs(a - b).max() / np.abs(a).mean())


def loss_notes(cases: dict[str, Case], steps: int) -> str:
    """How far the losses of the two loops lie apart, beside what rounding alone does."""
    lines = []
    for (size, case), share in product(cases.items(), RATES):
        slowed = replace(
            case, epoch=case.epoch._replace(learning_rate=share * case.epoch.learning_rate)
        )
        ours, plain = slowed.ours(steps), slowed.plain(steps, 0)
        rounded = slowed.ours(steps, NUDGE)
        for first in (1, 10, steps):
            apart = [largest_difference(ours[:first], other[:first]) for other in (plain, rounded)]
            cells = (
                size,
                f"{slowed.epoch.learning_rate:g}",
                str(first),
                *(f"{a:.1e}" for a in apart),
            )
            lines.append(f"| {' | '.join(cells)} |")
    head = "| frames | rate | first steps | ours and plain | ours, weights off by rounding |"
    return "\n".join([head, "|---|---|---|---|---|", *lines])


def measure(options: argparse.Namespace) -> None:
    """Measure, then write the table and the page."""
    config = load_config(options.config)
    options.frames.mkdir(parents=True, exist_ok=True)
    cases = {
        f"{size[0]}x{size[1]}": open_case(config, options.results, options.frames, size)
        for size in SIZES
    }
    losses = loss_notes(cases, COMPARED_STEPS)
    rows = speeds(cases, options.rounds, STEPS)
    table = options.out.with_suffix(".csv")
    with atomic_path(table) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    packing = ", ".join(f"{case.pack_ms:.1f} ms for {size}" for size, case in cases.items())
    title = "python -m benchmarks.training_speed"
    notes = NOTES.format(packing=packing, steps=STEPS, losses=losses, rounds=options.rounds)
    lines = ([row[column] for column in COLUMNS[:-1]] for row in rows)
    columns = ("frames", "way", "samples/s", "samples per CPU second", "cores busy")
    write_page(options.out.with_suffix(".md"), title, notes, columns, lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    name = "python -m benchmarks.training_speed"
    parser = argparse.ArgumentParser(prog=name, description=__doc__)
    parser.add_argument("--results", type=Path, required=True, help="tree with mesh and plans")
    parser.add_argument("--frames", type=Path, required=True, help="where frames are kept")
    parser.add_argument("--config", type=Path, default=CONFIG, help=f"the profile ({CONFIG})")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help=f"rounds ({ROUNDS})")
    parser.add_argument("--out", type=Path, default=OUT / "training_speed", help="without ending")
    options = parser.parse_args(arguments)
    return exit_status(lambda: measure(options), "rendered frames are kept")


if __name__ == "__main__":
    sys.exit(main())
