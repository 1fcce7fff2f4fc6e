"""What pretrained backbones are worth: five localizers, from scratch and pretrained, by size.

``python -m benchmarks.pretraining --results results/mini`` trains on the Large Room with the
profile's images shown for each size, several seeds each.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from benchmarks.training_pages import chosen, numbers, options_of, run, with_range, write_page
from benchmarks.trainings import Row, Training, training_of
from synfeal.config.models import MODELS, Config
from synfeal.files import atomic_path
from synfeal.report.figures.style import MODEL_STYLES, RC
from synfeal.report.layouts import TITLES

SIZES, REPETITIONS = ("6k", "20k", "40k"), 3
INITS = ("scratch", "pretrained")
MEASURES = {"position_m": "position", "orientation_deg": "orientation"}


def trainings(config: Config, options: argparse.Namespace) -> list[Training]:
    """All trainings, small sets first, one repetition after the other."""
    return [
        training_of(config, options.results, model, size, init, repetition, options.samples)
        for size, repetition, model, init in product(
            SIZES, range(options.repetitions), config.localizers, INITS
        )
    ]


def change_percent(rows: list[Row], measure: str) -> list[float]:
    """Change of the median error by pretraining, %, for every seed that has both."""
    of = {init: {r["repetition"]: r for r in chosen(rows, init=init)} for init in INITS}
    both = [(of["scratch"][k], of["pretrained"][k]) for k in of["scratch"] if k in of["pretrained"]]
    return [100 * (float(p[measure]) / float(s[measure]) - 1) for s, p in both]


def write(config: Config, options: argparse.Namespace, rows: list[Row]) -> None:
    """The page and the picture."""
    cells = [
        (size, model, chosen(rows, model=model, size=size))
        for size, model in product(SIZES, MODELS)
    ]
    cells = [cell for cell in cells if change_percent(cell[2], "position_m")]
    notes = (
        "Large Room, median errors on the test set against the true poses. Mean over the seeds, in"
        " brackets the least and the largest; changes are taken seed by seed, below 0 pretraining"
        " helps. Both kinds are shown as many images of the room; what the pretext took is not"
        " counted."
    )
    columns = ["size", "images shown", "localizer", "seeds"]
    columns += [
        "scratch, m",
        "pretrained, m",
        "change, %",
        "scratch, °",
        "pretrained, °",
        "change, %",
    ]
    lines = [line_of(*cell) for cell in cells]
    title = "python -m benchmarks.pretraining"
    write_page(options.out.with_suffix(".md"), title, notes, columns, lines)
    draw(options.out.with_suffix(".png"), rows)


def line_of(size: str, model: str, rows: list[Row]) -> list[str]:
    """A line of the table."""
    cells = [size, rows[0]["samples_seen"], TITLES[model]]
    cells.append(str(len(change_percent(rows, "position_m"))))
    for measure, digits in (("position_m", 3), ("orientation_deg", 2)):
        cells += [with_range(numbers(chosen(rows, init=i), measure), digits) for i in INITS]
        cells.append(with_range(change_percent(rows, measure), 0))
    return cells


def draw(path: Path, rows: list[Row]) -> None:
    """Change by pretraining for every size: a mark per seed, a line through the means."""
    with mpl.rc_context(RC), atomic_path(path) as temporary:
        figure = Figure(figsize=(8.4, 4.2), layout="constrained")
        panels = figure.subplots(1, len(MEASURES), sharey=True)
        for axes, (measure, title) in zip(panels, MEASURES.items(), strict=True):
            for offset, (model, style) in enumerate(MODEL_STYLES.items()):
                means = []
                for place, size in enumerate(SIZES):
                    values = change_percent(chosen(rows, model=model, size=size), measure)
                    at = place + 0.12 * (offset - 2)
                    marks = style | {"linestyle": "", "markersize": 3.5, "alpha": 0.6}
                    axes.plot([at] * len(values), values, **marks)
                    means += [(at, sum(values) / len(values))] if values else []
                line = style | {"marker": "", "linewidth": 1.2}
                label_style = style | {"linewidth": 1.2}
                axes.plot(*zip(*means, strict=True), **line)
                axes.plot([], [], label=TITLES[model], **label_style)
            axes.axhline(0, color="0.6", linewidth=0.8)
            axes.set_xticks(range(len(SIZES)), SIZES)
            axes.set(title=title, xlabel="size of the data set")
            axes.grid(color="0.94", axis="y")
        panels[0].set_ylabel("change of the median error by pretraining, %")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
        figure.savefig(temporary, dpi=130)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    parser = options_of("pretraining", __doc__, REPETITIONS)
    return run(parser.parse_args(arguments), trainings, write)


if __name__ == "__main__":
    sys.exit(main())
