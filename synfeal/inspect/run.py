"""A first look at a mesh: what ``synfeal inspect`` finds out once, draws and writes."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig, SceneConfig
from synfeal.files import atomic_path, refuse_foreign, write_json
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.inspect.doubts import Inspection
from synfeal.inspect.facts import facts_of
from synfeal.inspect.surface import ACROSS_RAD, viewer_mesh
from synfeal.inspect.text import Facts, how_to_go_on, page_html, plain_text, sections_of
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.render import open_renderer

Array = NDArray[np.float64]


OUTPUTS = ("inspect.json", "inspect.png", "inspect.html")
N_LEVEL_RAYS = 64
BOX_RGB = (213, 94, 0)


def inspect_mesh(scene: SceneConfig, out: Path, unit_is_given: bool = True) -> str:
    """Write ``inspect.json``, ``inspect.png`` and ``inspect.html`` into ``out``; the text to print.

    Earlier files of these names are replaced. A ``sampling_box`` of the scene confines the search
    for free space; its unit may be doubted unless it is given.

    Raises:
        InputError: the mesh cannot be used, the box misses it, or ``out`` holds other files.
    """
    refuse_foreign(out, OUTPUTS, "an inspection")
    found = Inspection.of(scene, unit_is_given or scene.sampling_box is not None)
    facts = facts_of(found)
    picture = _picture(facts, found)
    edges = [] if found.suggested_m is None else box_lines(found.suggested_m)
    heading = heading_from_opening(found.caster, found.viewpoint_m)
    drawing = viewer_mesh(found.mesh, found.surface).scene(
        [(edge, BOX_RGB) for edge in edges], heading
    )
    page = page_html(
        facts["title"], facts["doubts"], sections_of(facts), how_to_go_on(facts), picture, drawing
    )
    _write(out / OUTPUTS[1], picture)
    _write(out / OUTPUTS[2], page.encode("utf-8"))
    write_json(out / OUTPUTS[0], facts)
    return plain_text(facts)


def box_lines(box_m: Array) -> list[Array]:
    """The edges of a box (2, 3) as polylines (N, 3): bottom, top and four uprights."""
    (x0, y0, z0), (x1, y1, z1) = box_m
    ring = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])
    rings = [np.column_stack([ring, np.full(5, z)]) for z in (z0, z1)]
    return [*rings, *(np.stack([rings[0][i], rings[1][i]]) for i in range(4))]


def heading_from_opening(caster: RayCaster, position_m: Array) -> float:
    """Heading, radians, that looks in through the side level rays from (3,) escape to most.

    Across the corners of a room where none or all escape.
    """
    yaw = np.linspace(0.0, 2.0 * np.pi, N_LEVEL_RAYS, endpoint=False)
    level = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
    hits_m = caster.first_hit_m(np.broadcast_to(position_m, level.shape), level)
    out = level[np.isinf(hits_m)].sum(axis=0)
    if np.linalg.norm(out) < 1.0:
        return ACROSS_RAD
    return float(np.arctan2(-out[1], -out[0]))


def _picture(facts: Facts, found: Inspection) -> bytes:
    """Title, numbers and views; the mesh is cut at mid-height of the box, if there is one."""
    mesh, suggested_m, position_m = found.mesh, found.suggested_m, found.viewpoint_m
    low, high = mesh.bounds_m
    cut_m = float(low[2] + 0.6 * (high[2] - low[2]))
    if suggested_m is not None:
        cut_m = float(suggested_m[:, 2].mean())
    values = facts["properties"]
    size = " × ".join(f"{extent:.2f}" for extent in values["extents_m"])
    caption = (
        f"{values['vertices']:,} vertices, {values['faces']:,} faces, {size} m,"
        f" {facts['free_space']['share']:.0%} of the box is free space"
    )
    views, top = inside_views(mesh, position_m), top_view(mesh, cut_m)
    return picture_png(facts["title"], caption, top, cut_m, suggested_m, position_m, views)


def _write(path: Path, content: bytes) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


SIZE_INCH, DPI = (16.0, 8.8), 100
ACCENT = "#d55e00"
LOOKS_ALONG = {0: "+x", 90: "+y", 180: "-x", 270: "-y"}
OUTLINE = [withStroke(linewidth=3, foreground="white")]
ARROW: dict[str, Any] = {"arrowstyle": "-|>", "color": "black", "path_effects": OUTLINE}
POINTS: dict[str, Any] = {"textcoords": "offset points", "path_effects": OUTLINE}


def picture_png(
    title: str,  # heading
    caption: str,  # one line below it
    top: TopView,  # the mesh from above
    cut_m: float,  # height above which ``top`` shows nothing
    box_m: Array | None,  # (2, 3) the suggested sampling box, if there is one
    position_m: Array,  # (3,) where ``views`` were taken
    views: Sequence[Rgb],  # one image for each of ``YAWS_DEG``
) -> bytes:
    """The picture as PNG, 1600 x 880 pixels."""
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
    place = ", ".join(f"{value:.2f}" for value in position_m)
    said = f"Views from ({place}) m, 75° wide, as a camera will see them."
    figure.text(0.45, 0.03, said, fontsize=10, color="0.35")
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
    axes.annotate(text, (x0, y1), (0, 4), va="bottom", fontsize=9, color=ACCENT, **POINTS)


def _draw_position(axes: Axes, position_m: Array, reach: float) -> None:
    """A dot with an arrow for each view."""
    x, y = position_m[:2]
    for yaw in YAWS_DEG:
        dx, dy = reach * math.cos(math.radians(yaw)), reach * math.sin(math.radians(yaw))
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops=ARROW)
        label = axes.text(x + 1.35 * dx, y + 1.35 * dy, f"{yaw}°", ha="center", va="center")
        label.set(fontsize=9, path_effects=OUTLINE)
    axes.plot([x], [y], "o", color="black", markersize=6, markeredgecolor="white")


def _draw_scale(axes: Axes, top: TopView) -> None:
    """A bar of a round length near a fifth of the width, below the image on the right."""
    x0, x1, y0, y1 = top.extent_m
    length = round_length_m((x1 - x0) / 5.0)
    right, height = x1 - 0.03 * (x1 - x0), y0 + 0.025 * (y1 - y0)
    bar = axes.plot([right - length, right], [height] * 2, color="black", linewidth=4)
    bar[0].set_path_effects([withStroke(linewidth=7, foreground="white")])
    middle = (right - length / 2, height)
    axes.annotate(f"{length:g} m", middle, (0, 5), ha="center", fontsize=10, **POINTS)


def round_length_m(length_m: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most ``length_m``."""
    power = 10.0 ** math.floor(math.log10(length_m))
    return max(
        factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= length_m * (1 + 1e-9)
    )


Rgb = NDArray[np.uint8]

YAWS_DEG = (0, 90, 180, 270)
VIEW_CAMERA = CameraConfig(width=640, height=480, horizontal_fov_deg=75.0)
TOP_PX = 1100  # the longer side of the top view
TOP_FOV_DEG = 2.0  # so far away that the view is as good as orthographic
MARGIN = 0.04
WORLD_FROM_CAM_ABOVE: Array = np.diag([1.0, -1.0, -1.0])  # x right, y up in the image


class TopView(NamedTuple):
    """Colours (H, W, 3), white where nothing is, and the world they span: x0, x1, y0, y1."""

    rgb: Rgb
    extent_m: tuple[float, float, float, float]


def inside_views(mesh: TexturedMesh, position_m: Array) -> list[Rgb]:
    """What a level camera at (3,) sees at each of ``YAWS_DEG``."""
    with open_renderer(mesh, VIEW_CAMERA) as renderer:
        turns = rotation_from_rpy([[0.0, 0.0, math.radians(yaw)] for yaw in YAWS_DEG])
        return [renderer.render(pose_matrix(turn, position_m)) for turn in turns]


def top_view(mesh: TexturedMesh, cut_m: float) -> TopView:
    """The mesh below the height ``cut_m``, from far above: the near plane takes the ceiling off."""
    low, high = mesh.bounds_m
    middle = (low + high) / 2.0
    sides_m = (1.0 + 2.0 * MARGIN) * np.maximum(high - low, 1e-6)[:2]
    px_per_m = TOP_PX / float(sides_m.max())
    width, height = (int(px) for px in np.clip(np.round(sides_m * px_per_m), 16, TOP_PX))
    half = np.array([width, height]) / px_per_m / 2.0
    distance = float(half[0]) / math.tan(math.radians(TOP_FOV_DEG) / 2.0)
    camera = CameraConfig(
        width=width,
        height=height,
        horizontal_fov_deg=TOP_FOV_DEG,
        near_m=distance,
        far_m=distance + max(cut_m - float(low[2]), 0.0) + 0.01 * distance,
    )
    eye = [middle[0], middle[1], cut_m + distance]
    with open_renderer(mesh, camera) as renderer:
        rgb, depth = renderer.render_rgbd(pose_matrix(WORLD_FROM_CAM_ABOVE, eye))
    rgb[np.isinf(depth)] = 255
    (x0, y0), (x1, y1) = middle[:2] - half, middle[:2] + half
    return TopView(rgb, (float(x0), float(x1), float(y0), float(y1)))
