"""What a localizer costs and how wrong it is, by image side, width and architecture.

``python -m benchmarks.learners --results results/mini`` trains PoseNet2 in every shape of a grid,
and all localizers in the profile's shape, from scratch on the Large Room with as many images.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.scene_difficulty.pool import run_tasks
from benchmarks.training_pages import chosen, numbers, options_of, run, with_range, write_page
from benchmarks.trainings import LARGEST, SCENE, Row, Training, training_of
from synfeal.config.models import MODELS, Config, ModelName, NetworkConfig
from synfeal.dataset.packed import join_packed
from synfeal.dataset.packed_record import write_packed_record
from synfeal.dataset.pose_table import read_frames
from synfeal.dataset.render_sequence import render_packed
from synfeal.files import atomic_path
from synfeal.report.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    MODEL_STYLES,
    ORANGE,
    RC,
    VERMILION,
    Style,
)
from synfeal.report.layouts import TITLES

SIZE, SAMPLES = "20k", 8000
MODEL: ModelName = "posenet2"
# 92: frames of 128x96 hold no square of more than 95 pixels.
SIDES_PX, WIDTHS = (32, 48, 64, 92), (0.125, 0.25, 0.5)
SIDE_COLORS = dict(zip(SIDES_PX, (ORANGE, GREEN, BLUE, BLACK), strict=True))
WIDTH_SIZES = dict(zip(WIDTHS, (5, 8, 12), strict=True))
RING: Style = {
    "linestyle": "",
    "marker": "o",
    "markersize": 17,
    "markerfacecolor": "none",
    "markeredgecolor": VERMILION,
}
SPLITS = ("train", "test")


def trainings(config: Config, options: argparse.Namespace) -> list[Training]:
    """All trainings; frames of other sides are rendered first, where they are not there."""
    shapes: list[tuple[ModelName, NetworkConfig]] = [
        (MODEL, config.network.model_copy(update={"input_px": side_px, "width": width}))
        for side_px, width in product(SIDES_PX, WIDTHS)
    ]
    shapes += [(model, config.network) for model in config.localizers]
    unique = list({(m, n.input_px, n.width): (m, n) for m, n in shapes}.values())
    folders = {n.input_px: frames_of(config, options, n.input_px) for _, n in unique}
    found = []
    for repetition, (model, network) in product(range(options.repetitions), unique):
        samples = options.samples or SAMPLES
        base = training_of(config, options.results, model, SIZE, "scratch", repetition, samples)
        key = {"input_px": network.input_px, "width": network.width, **base.key}
        frames = folders[network.input_px]
        found.append(base._replace(key=key, network=network, frames=frames))
    return found


def frames_of(config: Config, options: argparse.Namespace, input_px: int) -> Path:
    """Directory of frames of a side: the profile's own, or rendered into ``--frames``."""
    if input_px == config.network.input_px:
        return Path(options.results) / "frames" / SCENE
    folder = Path(options.frames) / f"{input_px}px"
    missing = [split for split in SPLITS if not (folder / f"{split}.json").exists()]
    tasks = [(config, options.results, split, input_px, folder) for split in missing]
    run_tasks(render, tasks, options.jobs, f"frames of {input_px} px")
    return folder


def render(config: Config, root: Path, split: str, input_px: int, folder: Path) -> None:
    """Packed frames of a split with their record, which is written last."""
    plan = root / "plans" / SCENE / f"{split}.csv"
    size = LARGEST if split == "test" else SIZE  # what a training is judged on: see ``measure``
    poses = read_frames(plan, 0, config.n_frames(SCENE, size, split))
    mesh, shard = root / "scenes" / SCENE / "mesh.glb", folder / f"{split}-shard.npy"
    render_packed(mesh, config.network_camera, poses, input_px, shard, config.render)
    out, record = folder / f"{split}.npy", shard.with_suffix(".json")
    join_packed([shard], out)
    write_packed_record(out, [record], plan, config.network_camera, config.render)
    shard.unlink()
    record.unlink()


def is_profiles(row: Row, network: NetworkConfig) -> bool:
    """Whether a row has the shape that the profile uses."""
    return (int(row["input_px"]), float(row["width"])) == (network.input_px, network.width)


def write(config: Config, options: argparse.Namespace, rows: list[Row]) -> None:
    """The page and the picture."""
    names = ("model", "input_px", "width")
    kinds = dict.fromkeys(tuple(row[name] for name in names) for row in rows)
    cells = [chosen(rows, **dict(zip(names, kind, strict=True))) for kind in kinds]
    columns = ["localizer", "side, px", "width", "seeds", "training, CPU s", "ms/image, one by one"]
    columns += ["ms/image, 100 at once", "position, m", "orientation, °"]
    notes = (
        f"Large Room, {SIZE}, from scratch, {rows[0]['samples_seen']} images shown with the"
        " learning rate of the profile whatever the shape; errors are medians on the test set"
        " against the true poses, mean over the seeds. One thread; trainings side by side"
        " share a cache, which their times hold. In bold: the profile's shape."
    )
    lines = [line_of(cell, is_profiles(cell[0], config.network)) for cell in cells]
    title = "python -m benchmarks.learners"
    write_page(options.out.with_suffix(".md"), title, notes, columns, lines)
    draw(options.out.with_suffix(".png"), rows, config.network)


def line_of(rows: list[Row], bold: bool) -> list[str]:
    """A line of the table."""
    first, mark = rows[0], "**" if bold else ""
    shape = [f"{mark}{first[name]}{mark}" for name in ("input_px", "width")]
    seconds = [with_range(numbers(rows, "train_cpu_s"), 1)]
    seconds += [with_range(numbers(rows, f"predict_ms_{n}"), 2) for n in (1, 100)]
    errors = [with_range(numbers(rows, "position_m"), 3)]
    errors.append(with_range(numbers(rows, "orientation_deg"), 2))
    return [TITLES[first["model"]], *shape, str(len(rows)), *seconds, *errors]


def draw(path: Path, rows: list[Row], network: NetworkConfig) -> None:
    """Errors against the time to train: colour is the side, size the width; others are hollow."""
    with mpl.rc_context(RC), atomic_path(path) as temporary:
        figure = Figure(figsize=(9.0, 4.4), layout="constrained")
        panels = figure.subplots(1, 2)
        errors = {"position_m": "position error, m", "orientation_deg": "orientation error, °"}
        for axes, (measure, title) in zip(panels, errors.items(), strict=True):
            for row in rows:
                style = style_of(row)
                axes.plot(float(row["train_cpu_s"]), float(row[measure]), **style)
                if row["model"] == MODEL and is_profiles(row, network):
                    axes.plot(float(row["train_cpu_s"]), float(row[measure]), **RING)
            axes.set(xscale="log", xlabel="processor seconds to train", ylabel=f"median {title}")
            axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
            axes.grid(color="0.93", which="both")
        figure.legend(handles=handles(), loc="outside right center")
        figure.savefig(temporary, dpi=130)


def style_of(row: Row) -> Style:
    """The mark of a row."""
    colour = SIDE_COLORS.get(int(row["input_px"]), VERMILION)
    style: Style = {"linestyle": "", "markeredgecolor": colour}
    if row["model"] == MODEL:
        size = WIDTH_SIZES.get(float(row["width"]), 8)
        return style | {"marker": "o", "markerfacecolor": colour, "markersize": size}
    marker = MODEL_STYLES[row["model"]]["marker"]
    marker = "P" if marker == "o" else marker
    return style | {"marker": marker, "markerfacecolor": "none", "markersize": 8}


def handles() -> list[Line2D]:
    """The legend."""
    base = {"model": MODEL, "input_px": "64", "width": "0.25"}
    shown = {f"{TITLES[MODEL]}, {side} px": base | {"input_px": str(side)} for side in SIDES_PX}
    shown |= {f"width {width:g}": base | {"width": str(width)} for width in WIDTHS}
    shown |= {TITLES[model]: base | {"model": model} for model in MODELS if model != MODEL}
    marks = [Line2D([], [], label=label, **style_of(row)) for label, row in shown.items()]
    return [*marks, Line2D([], [], label="the profile's shape", **RING)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    parser = options_of("learners", __doc__, 1)
    parser.add_argument(
        "--frames", type=Path, required=True, help="where frames of other sides are kept"
    )
    return run(parser.parse_args(arguments), trainings, write)


if __name__ == "__main__":
    sys.exit(main())
