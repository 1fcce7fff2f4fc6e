"""Collected frames: what the localizers see."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.manifest import MANIFEST
from synfeal.errors import InputError
from synfeal.report.figures.sources import Results
from synfeal.report.layouts import scene_title
from synfeal.report.results import read_result

LINES, COLUMNS = 2, 6
WIDTH_INCH, TITLE_INCH = 11.0, 0.32
OUTLINE = [withStroke(linewidth=2.5, foreground="black")]


@dataclass(frozen=True)
class Tile:
    """A frame: its number in the test split, and its file."""

    number: int
    path: Path


def draw(results: Results) -> Figure | None:
    """Two rows of six test frames per scene, evenly over the largest test set."""
    scenes = {scene: test_frames(results, scene) for scene in results.scenes}
    if not scenes:
        return None
    height, width = read_rgb(next(iter(scenes.values()))[0].path).shape[:2]
    row_inch = WIDTH_INCH / COLUMNS * height / width
    size = (WIDTH_INCH, len(scenes) * (LINES * row_inch + TITLE_INCH))
    layout = ConstrainedLayoutEngine(w_pad=0.015, h_pad=0.015, wspace=0, hspace=0)
    figure = Figure(figsize=size, layout=layout)
    parts = figure.subfigures(len(scenes), 1, squeeze=False)[:, 0]
    for part, (scene, frames) in zip(parts, scenes.items(), strict=True):
        tiles = [frames[index] for index in evenly(len(frames))]
        part.suptitle(f"{scene_title(scene)}: {len(tiles)} of {len(frames):,} test frames")
        panels = part.subplots(LINES, COLUMNS)
        for axes in panels.flat:
            axes.set_axis_off()
        for axes, tile in zip(panels.flat, tiles, strict=False):
            _draw_tile(axes, tile)
    return figure


def test_frames(results: Results, scene: str) -> list[Tile]:
    """All test frames of a scene in order, numbered through its sequences.

    Raises:
        InputError: the manifest is missing or unreadable.
    """
    folder = results.root / "datasets" / scene / "network"
    manifest = read_result(folder / MANIFEST, ["sequences"], "collect that data set again")
    names = [
        (folder / sequence["name"], index)
        for sequence in manifest["sequences"]
        if sequence["split"] == "test"
        for index in range(sequence["frames"])
    ]
    return [
        Tile(number, sequence / f"frame-{index:06d}.color.png")
        for number, (sequence, index) in enumerate(names)
    ]


def evenly(count: int) -> list[int]:
    """At most twelve indices below ``count``, spread evenly, the first and the last among them."""
    n_tiles = min(LINES * COLUMNS, count)
    return [round(place) for place in np.linspace(0, count - 1, n_tiles)]


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """Pixels (H, W, 3) of a frame.

    Raises:
        InputError: the file is missing or is no image.
    """
    try:
        with Image.open(path) as image:
            return np.asarray(image.convert("RGB"))
    except (OSError, SyntaxError) as error:
        raise InputError(f"{path}: cannot be read as an image ({error})") from None


def _draw_tile(axes: Axes, tile: Tile) -> None:
    axes.imshow(read_rgb(tile.path), interpolation="lanczos")
    axes.text(
        *(0.03, 0.04),
        f"{tile.number}",
        transform=axes.transAxes,
        color="white",
        fontsize=9,
        path_effects=OUTLINE,
    )
