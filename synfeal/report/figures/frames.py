"""Collected frames: what the localizers see."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from synfeal.dataset.packed import read_packed
from synfeal.report.figures.sources import Results
from synfeal.report.layouts import scene_title

LINES, COLUMNS = 2, 6
WIDTH_INCH, TITLE_INCH = 11.0, 0.32
OUTLINE = [withStroke(linewidth=2.5, foreground="black")]


def draw(results: Results) -> Figure | None:
    """Two rows of six test frames per scene, evenly over the largest test set."""
    scenes = {scene: test_frames(results, scene) for scene in results.scenes}
    if not scenes:
        return None
    height, width = next(iter(scenes.values())).shape[1:3]
    row_inch = WIDTH_INCH / COLUMNS * height / width
    size = (WIDTH_INCH, len(scenes) * (LINES * row_inch + TITLE_INCH))
    layout = ConstrainedLayoutEngine(w_pad=0.015, h_pad=0.015, wspace=0, hspace=0)
    figure = Figure(figsize=size, layout=layout)
    parts = figure.subfigures(len(scenes), 1, squeeze=False)[:, 0]
    for part, (scene, frames) in zip(parts, scenes.items(), strict=True):
        numbers = evenly(len(frames))
        part.suptitle(f"{scene_title(scene)}: {len(numbers)} of {len(frames):,} test frames")
        panels = part.subplots(LINES, COLUMNS)
        for axes in panels.flat:
            axes.set_axis_off()
        for axes, number in zip(panels.flat, numbers, strict=False):
            _draw_tile(axes, number, frames[number])
    return figure


def test_frames(results: Results, scene: str) -> NDArray[np.uint8]:
    """All test frames of a scene (N, H, W, 3), as a memory map."""
    return read_packed(results.root / "frames" / scene / "test.npy")


def evenly(count: int) -> list[int]:
    """At most twelve indices below ``count``, spread evenly, the first and the last among them."""
    n_tiles = min(LINES * COLUMNS, count)
    return [round(place) for place in np.linspace(0, count - 1, n_tiles)]


def _draw_tile(axes: Axes, number: int, rgb: NDArray[np.uint8]) -> None:
    axes.imshow(rgb, interpolation="lanczos")
    axes.text(
        *(0.03, 0.04),
        f"{number}",
        transform=axes.transAxes,
        color="white",
        fontsize=9,
        path_effects=OUTLINE,
    )
