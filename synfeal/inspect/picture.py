"""The picture: the mesh from above beside four views from inside."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from synfeal.inspect.views import YAWS_DEG, Rgb, TopView

Array = NDArray[np.float64]

SIZE_INCH, DPI = (16.0, 8.8), 100
ACCENT = "#d55e00"
LOOKS_ALONG = {0: "+x", 90: "+y", 180: "-x", 270: "-y"}
OUTLINE = [withStroke(linewidth=3, foreground="white")]


def picture_png(
    title: str,
    caption: str,
    top: TopView,
    cut_m: float,
    box_m: Array | None,
    position_m: Array,
    views: Sequence[Rgb],
) -> bytes:
    """The picture as PNG, 1600 x 880 pixels.

    Args:
        title: heading.
        caption: one line below it.
        top: the mesh from above.
        cut_m: height above which ``top`` shows nothing.
        box_m: (2, 3) the suggested sampling box, if there is one.
        position_m: (3,) where ``views`` were taken.
        views: one image for each of ``YAWS_DEG``.
    """
    figure = Figure(figsize=SIZE_INCH, dpi=DPI)
    figure.text(0.02, 0.96, title, fontsize=17, weight="bold", va="center", parse_math=False)
    figure.text(0.02, 0.92, caption, fontsize=11, color="0.35", va="center", parse_math=False)
    _draw_top(figure.add_axes((0.045, 0.07, 0.385, 0.79)), top, cut_m, box_m, position_m)
    for index, (yaw, view) in enumerate(zip(YAWS_DEG, views, strict=True)):
        left, bottom = 0.45 + 0.272 * (index % 2), 0.50 - 0.43 * (index // 2)
        axes = figure.add_axes((left, bottom, 0.265, 0.36))
        axes.imshow(view)
        axes.set_axis_off()
        axes.set_title(f"yaw {yaw}°: along {LOOKS_ALONG[yaw]}", fontsize=11, loc="left", pad=4)
    figure.text(
        0.45,
        0.03,
        "Views from ({:.2f}, {:.2f}, {:.2f}) m, 75° wide, as a camera will see them.".format(
            *position_m
        ),
        fontsize=10,
        color="0.35",
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _draw_top(
    axes: Axes, top: TopView, cut_m: float, box_m: Array | None, position_m: Array
) -> None:
    axes.imshow(top.rgb, extent=top.extent_m, interpolation="antialiased")
    axes.set_title(f"From above, cut at z = {cut_m:.2f} m", fontsize=11, loc="left")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_anchor("N")
    if box_m is not None:
        _draw_box(axes, box_m)
    reach = 0.05 * max(top.extent_m[1] - top.extent_m[0], top.extent_m[3] - top.extent_m[2])
    _draw_position(axes, position_m, reach)
    _draw_scale(axes, top)


def _draw_box(axes: Axes, box_m: Array) -> None:
    (x0, y0, z0), (x1, y1, z1) = box_m
    frame = Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=ACCENT, linewidth=2)
    frame.set_linestyle("--")
    frame.set_path_effects([withStroke(linewidth=4, foreground="white")])
    axes.add_patch(frame)
    text = f"suggested sampling box, z {z0:.2f} to {z1:.2f} m"
    axes.annotate(
        text,
        (x0, y1),
        (0, 4),
        textcoords="offset points",
        va="bottom",
        fontsize=9,
        color=ACCENT,
        path_effects=OUTLINE,
    )


def _draw_position(axes: Axes, position_m: Array, reach: float) -> None:
    """A dot with an arrow for each view."""
    x, y = position_m[:2]
    for yaw in YAWS_DEG:
        dx, dy = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
        axes.annotate(
            "",
            (x + reach * dx, y + reach * dy),
            (x, y),
            arrowprops={"arrowstyle": "-|>", "color": "black", "path_effects": OUTLINE},
        )
        axes.text(
            x + 1.35 * reach * dx,
            y + 1.35 * reach * dy,
            f"{yaw}°",
            ha="center",
            va="center",
            fontsize=9,
            path_effects=OUTLINE,
        )
    axes.plot([x], [y], "o", color="black", markersize=6, markeredgecolor="white")


def _draw_scale(axes: Axes, top: TopView) -> None:
    """A bar of a round length near a fifth of the width, below the image on the right."""
    x0, x1, y0, y1 = top.extent_m
    length = round_length_m((x1 - x0) / 5.0)
    right, height = x1 - 0.03 * (x1 - x0), y0 + 0.025 * (y1 - y0)
    bar = axes.plot([right - length, right], [height] * 2, color="black", linewidth=4)
    bar[0].set_path_effects([withStroke(linewidth=7, foreground="white")])
    axes.annotate(
        f"{length:g} m",
        (right - length / 2, height),
        (0, 5),
        textcoords="offset points",
        ha="center",
        fontsize=10,
        path_effects=OUTLINE,
    )


def round_length_m(length_m: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most ``length_m``."""
    power = 10.0 ** math.floor(math.log10(length_m))
    return max(
        factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= length_m * (1 + 1e-9)
    )
