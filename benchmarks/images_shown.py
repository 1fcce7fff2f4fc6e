"""What a localizer gains from more images shown: PoseNet2 on the largest Large Room set.

``python -m benchmarks.images_shown --results results/mini`` trains anew for every number of images,
with the profile's settings, because the learning rate falls over the whole of a training.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import product

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from benchmarks.training_pages import chosen, numbers, options_of, run, with_range, write_page
from benchmarks.trainings import LARGEST, SCENE, Row, Training, training_of
from synfeal.config.models import Config, ModelName
from synfeal.files import atomic_path
from synfeal.report.figures.style import MODEL_STYLES, RC

MODEL: ModelName = "posenet2"
SAMPLES = (12_000, 24_000, 48_000, 96_000, 192_000)
MEASURES = {"position_m": "position error, m", "orientation_deg": "orientation error, °"}


def trainings(config: Config, options: argparse.Namespace) -> list[Training]:
    """One training for each number of images, the shortest first; ``--samples`` names one alone."""
    counts = (options.samples,) if options.samples else SAMPLES
    return [
        training_of(config, options.results, MODEL, LARGEST, "pretrained", repetition, count)
        for repetition, count in product(range(options.repetitions), counts)
    ]


def counts_of(rows: Sequence[Row]) -> list[int]:
    """Numbers of images that were shown, each once."""
    return sorted({int(row["samples_seen"]) for row in rows})


def write(config: Config, options: argparse.Namespace, rows: list[Row]) -> None:
    """The page and the picture."""
    frames = config.n_frames(SCENE, LARGEST, "train")
    notes = (
        f"PoseNet2 in the profile's shape, pretrained, on the {frames} frames of the Large Room's"
        f" largest set; the profile shows {config.training.samples_seen[LARGEST]} images. Median"
        " errors on the test set against the true poses; mean over the seeds, in brackets the least"
        " and the largest. One thread."
    )
    columns = (
        "images shown",
        "epochs",
        "seeds",
        "training, CPU s",
        "position, m",
        "orientation, °",
    )
    lines = [line_of(count, frames, chosen(rows, samples_seen=count)) for count in counts_of(rows)]
    title = "python -m benchmarks.images_shown"
    write_page(options.out.with_suffix(".md"), title, notes, columns, lines)
    draw(options, rows, config.training.samples_seen[LARGEST])


def line_of(count: int, frames: int, rows: list[Row]) -> list[str]:
    """A line of the table."""
    cells = [str(count), f"{count / frames:.0f}", str(len(rows))]
    for column, digits in (("train_cpu_s", 0), ("position_m", 3), ("orientation_deg", 2)):
        cells.append(with_range(numbers(rows, column), digits))
    return cells


def draw(options: argparse.Namespace, rows: list[Row], profiles: int) -> None:
    """Errors against the images shown, both logarithmic; a line marks what the profile shows."""
    with mpl.rc_context(RC), atomic_path(options.out.with_suffix(".png")) as temporary:
        figure = Figure(figsize=(7.6, 3.4), layout="constrained")
        for axes, (measure, title) in zip(figure.subplots(1, 2), MEASURES.items(), strict=True):
            axes.axvline(profiles, color="0.7", linewidth=0.9)
            marks = MODEL_STYLES[MODEL] | {"linestyle": ""}
            axes.plot(numbers(rows, "samples_seen"), numbers(rows, measure), **marks)
            axes.set(xscale="log", yscale="log", xlabel="images shown", ylabel=f"median {title}")
            axes.set_xticks(counts_of(rows), [f"{count:,}" for count in counts_of(rows)])
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))
            axes.yaxis.set_major_formatter("{x:g}")
            axes.minorticks_off()
            axes.grid(color="0.93", which="both")
        figure.savefig(temporary, dpi=130)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    parser = options_of("images_shown", __doc__, 1)
    return run(parser.parse_args(arguments), trainings, write)


if __name__ == "__main__":
    sys.exit(main())
