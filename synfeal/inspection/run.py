"""``synfeal inspect`` as a function: examine a mesh, draw it, write the page."""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from synfeal.config.collection import SceneConfig
from synfeal.config.dataset import CameraConfig, RenderConfig, Shade
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.inspection.doubts import Inspection
from synfeal.inspection.facts import facts_of
from synfeal.inspection.surface import ACROSS_RAD, viewer_mesh
from synfeal.inspection.text import Facts, how_to_go_on, page_html, plain_text, sections_of
from synfeal.mesh.ambient import with_ambient_light
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.records.files import atomic_path, refuse_foreign, write_json
from synfeal.records.progress import at_work
from synfeal.render import open_renderer

Array = NDArray[np.float64]


Rgb = NDArray[np.uint8]

OUTPUTS = ("inspect.json", "inspect.png", "inspect.html")
N_LEVEL_RAYS = 64
BOX_RGB = (213, 94, 0)
BOX_COLOR = "#{:02x}{:02x}{:02x}".format(*BOX_RGB)
SIZE_INCH, DPI = (16.0, 8.8), 100
LOOKS_ALONG = {0: "+x", 90: "+y", 180: "-x", 270: "-y"}  # by yaw, degrees
OUTLINE = [withStroke(linewidth=3, foreground="white")]
ARROW: dict[str, Any] = {"arrowstyle": "-|>", "color": "black", "path_effects": OUTLINE}
POINTS: dict[str, Any] = {"textcoords": "offset points", "path_effects": OUTLINE}
VIEW_CAMERA = CameraConfig(width=640, height=480, horizontal_fov_deg=75.0)
TOP_PX = 1100  # the longer side of the top view
TOP_FOV_DEG = 2.0  # so far away that the view is as good as orthographic
MARGIN = 0.04
WORLD_FROM_CAM_ABOVE: Array = np.diag([1.0, -1.0, -1.0])  # x right, y up in the image


def inspect_mesh(
    scene: SceneConfig,
    out: Path,
    unit_is_given: bool = True,
    *,
    wording: Callable[[str], str] = str,
) -> str:
    """Inspect a mesh and write ``inspect.json``, ``inspect.png`` and ``inspect.html``.

    Args:
        scene: Path, unit and up axis of the mesh; its ``sampling_box``, if any, confines the search
            for free space.
        out: Directory to write into; earlier files of these names are replaced.
        unit_is_given: Keep the scene's unit. Otherwise, and without a ``sampling_box``, one that
            makes no room of the mesh is replaced.
        wording: Rewords advice, which names arguments as Python has them.

    Returns:
        The findings as text to print.

    Raises:
        InputError: The mesh cannot be used, the box misses it, or ``out`` holds other files.
    """
    refuse_foreign(out, OUTPUTS, "an inspection")
    with at_work("inspect", "looking for free space and trying cameras there"):
        found = Inspection.of(scene, unit_is_given or scene.sampling_box is not None)
        facts = facts_of(found)
    facts["doubts"] = [wording(doubt) for doubt in facts["doubts"]]
    with at_work("inspect", "drawing"):
        picture = picture_png(facts, found)
    edges = [edge for box_m in found.suggested_m for edge in box_lines(box_m)]
    heading = heading_from_opening(found.caster, found.viewpoint_m)
    drawing = viewer_mesh(found.mesh, found.surface).scene(
        [(edge, BOX_RGB) for edge in edges], heading
    )
    page = page_html(
        facts["title"], facts["doubts"], sections_of(facts), how_to_go_on(facts), picture, drawing
    )
    for name, content in zip(OUTPUTS[1:], (picture, page.encode("utf-8")), strict=True):
        with atomic_path(out / name) as temporary:
            temporary.write_bytes(content)
    write_json(out / OUTPUTS[0], facts)
    return plain_text(facts)


def box_lines(box_m: Array) -> list[Array]:
    """Return the edges of a box (2, 3) as polylines (N, 3): bottom, top and four uprights."""
    (x0, y0, z0), (x1, y1, z1) = box_m
    ring = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])
    rings = [np.column_stack([ring, np.full(5, z)]) for z in (z0, z1)]
    return [*rings, *(np.stack([rings[0][i], rings[1][i]]) for i in range(4))]


def heading_from_opening(caster: RayCaster, position_m: Array) -> float:
    """Find the heading, radians, that looks into a room from the side where level rays escape.

    Across the corners of a room where none or all escape.
    """
    yaw = np.linspace(0.0, 2.0 * np.pi, N_LEVEL_RAYS, endpoint=False)
    level = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
    hits_m = caster.first_hit_m(np.broadcast_to(position_m, level.shape), level)
    out = level[np.isinf(hits_m)].sum(axis=0)
    if np.linalg.norm(out) < 1.0:
        return ACROSS_RAD
    return float(np.arctan2(-out[1], -out[0]))


def picture_png(facts: Facts, found: Inspection) -> bytes:
    """Draw title, numbers, the mesh from above and four views from inside as PNG, 1600 x 880 px.

    It is cut at mid-height of the suggested box, if there is one.
    """
    (_, _, low), (_, _, high) = found.searched.bounds_m.tolist()
    boxes_m, position_m = found.suggested_m, found.viewpoint_m
    cut_m = float(boxes_m[0, :, 2].mean()) if len(boxes_m) else low + 0.6 * (high - low)
    values = facts["properties"]
    size = " × ".join(f"{extent:.2f}" for extent in values["extents_m"])
    caption = (
        f"{values['vertices']:,} vertices, {values['faces']:,} faces, {size} m,"
        f" {facts['free_space']['share']:.0%} of the box is free space"
    )
    figure = Figure(figsize=SIZE_INCH, dpi=DPI)
    text = partial(figure.text, va="center", parse_math=False)
    text(0.02, 0.96, facts["title"], fontsize=17, weight="bold")
    text(0.02, 0.92, caption, fontsize=11, color="0.35")
    shade = None if found.suggestion is None else found.suggestion.shade
    views = inside_views(found.mesh, position_m, shade)
    _draw_top(figure, top_view(found.searched, cut_m), cut_m, boxes_m, position_m)
    for index, (yaw, view) in enumerate(zip(LOOKS_ALONG, views, strict=True)):
        left, bottom = 0.45 + 0.272 * (index % 2), 0.50 - 0.43 * (index // 2)
        axes = figure.add_axes((left, bottom, 0.265, 0.36))
        axes.imshow(view)
        axes.set_axis_off()
        axes.set_title(f"yaw {yaw}°: along {LOOKS_ALONG[yaw]}", fontsize=11, loc="left", pad=4)
    place = ", ".join(f"{value:.2f}" for value in position_m)
    light = "" if shade is None else f", lit by the {shade} light of the command"
    said = f"Views from ({place}) m, 75° wide, as a camera will see them{light}."
    figure.text(0.45, 0.03, said, fontsize=10, color="0.35")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _draw_top(
    figure: Figure, top: TopView, cut_m: float, boxes_m: Array, position_m: Array
) -> None:
    axes = figure.add_axes((0.045, 0.07, 0.385, 0.79))
    axes.imshow(top.rgb, extent=top.extent_m, interpolation="antialiased")
    axes.set_title(f"From above, cut at z = {cut_m:.2f} m", fontsize=11, loc="left")
    axes.set(xlabel="x (m)", ylabel="y (m)", anchor="N")
    for number, ((x0, y0, z0), (x1, y1, z1)) in enumerate(boxes_m):
        frame = Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=BOX_COLOR, linewidth=2)
        frame.set_linestyle("--")
        frame.set_path_effects([withStroke(linewidth=4, foreground="white")])
        axes.add_patch(frame)
        text = f"box {number + 1}, z {z0:.2f} to {z1:.2f} m"
        axes.annotate(text, (x0, y1), (0, 4), va="bottom", fontsize=9, color=BOX_COLOR, **POINTS)
    reach = 0.05 * max(top.extent_m[1] - top.extent_m[0], top.extent_m[3] - top.extent_m[2])
    _draw_position(axes, position_m, reach)
    _draw_scale(axes, top)


def _draw_position(axes: Axes, position_m: Array, reach: float) -> None:
    """Draw a dot with an arrow for each view."""
    x, y = position_m[:2]
    for yaw in LOOKS_ALONG:
        dx, dy = reach * math.cos(math.radians(yaw)), reach * math.sin(math.radians(yaw))
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops=ARROW)
        label = axes.text(x + 1.35 * dx, y + 1.35 * dy, f"{yaw}°", ha="center", va="center")
        label.set(fontsize=9, path_effects=OUTLINE)
    axes.plot([x], [y], "o", color="black", markersize=6, markeredgecolor="white")


def _draw_scale(axes: Axes, top: TopView) -> None:
    """Draw a scale bar of 1, 2 or 5 times a power of ten, a fifth of the width or less."""
    x0, x1, y0, y1 = top.extent_m
    fifth = (x1 - x0) / 5.0
    power = 10.0 ** math.floor(math.log10(fifth))
    length = max(k * power for k in (1.0, 2.0, 5.0) if k * power <= fifth * (1 + 1e-9))
    right, height = x1 - 0.03 * (x1 - x0), y0 + 0.025 * (y1 - y0)
    bar = axes.plot([right - length, right], [height] * 2, color="black", linewidth=4)
    bar[0].set_path_effects([withStroke(linewidth=7, foreground="white")])
    middle = (right - length / 2, height)
    axes.annotate(f"{length:g} m", middle, (0, 5), ha="center", fontsize=10, **POINTS)


class TopView(NamedTuple):
    """Colours (H, W, 3), white where nothing is, and the world they span: x0, x1, y0, y1."""

    rgb: Rgb
    extent_m: tuple[float, float, float, float]


def inside_views(mesh: TexturedMesh, position_m: Array, shade: Shade | None) -> list[Rgb]:
    """Draw what a level camera at (3,) sees at each of ``LOOKS_ALONG``, in the light of frames."""
    shown = with_ambient_light(mesh) if shade == "ambient" else mesh
    with open_renderer(shown, VIEW_CAMERA, RenderConfig(shade=shade)) as renderer:
        turns = rotation_from_rpy([[0.0, 0.0, math.radians(yaw)] for yaw in LOOKS_ALONG])
        return [renderer.render(pose_matrix(turn, position_m)) for turn in turns]


def top_view(mesh: TexturedMesh, cut_m: float) -> TopView:
    """Render the mesh below height ``cut_m`` from far above: the near plane removes the ceiling."""
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
