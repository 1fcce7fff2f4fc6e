"""Scenes and their data sets: collected frames, and every camera pose on a plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from trimesh.intersections import slice_faces_plane
from trimesh.triangles import area

from reproduction.figures.sources import SPLITS, Array, Results
from reproduction.figures.style import SPLIT_STYLES, Style
from reproduction.tables.layouts import scene_title
from synfeal.dataset.packed import read_packed
from synfeal.dataset.pose_table import PoseTable
from synfeal.mesh.triangles import Triangles, load_collision_mesh

LINES, COLUMNS = 2, 6
WIDTH_INCH, TITLE_INCH = 11.0, 0.32
OUTLINE = [withStroke(linewidth=2.5, foreground="black")]


def draw_frames(results: Results) -> Figure | None:
    """Draw two rows of six test frames per scene, evenly over the largest test set."""
    packed = results.root / "frames"
    scenes = {scene: read_packed(packed / scene / "test.npy") for scene in results.scenes}
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
            axes.imshow(frames[number], interpolation="lanczos")
            look = {"color": "white", "fontsize": 9, "path_effects": OUTLINE}
            axes.text(0.03, 0.04, f"{number}", transform=axes.transAxes, **look)
    return figure


def evenly(count: int) -> list[int]:
    """Return at most twelve indices below ``count``, evenly spread, first and last among them."""
    n_tiles = min(LINES * COLUMNS, count)
    return [round(place) for place in np.linspace(0, count - 1, n_tiles)]


# Dust on a scanned floor and skirting are no furniture.
ABOVE_FLOOR_M = 0.15
GREY = "0.86"
# Share of the surface that lies below the floor's height: holes dig, a floor is large.
FLOOR_SHARE = 0.02


@dataclass(frozen=True)
class Plan:
    """Part of a scene that a plan shows."""

    corners_m: Array  # (N, 3, 2) triangles from above, world x and y
    bounds_m: Array  # (2, 2) lower and upper corner of the whole mesh, world x and y


def read_plan(results: Results, scene: str) -> Plan:
    """Read the floor plan of a scene, cut above the highest camera of its true poses."""
    mesh = load_collision_mesh(results.root / "scenes" / scene / "collision.ply")
    largest = results.sizes(scene)[-1]
    return plan_of(mesh, results.labels(scene, largest, "synfeal", "train").position_m[:, 2].max())


def plan_of(mesh: Triangles, top_m: float) -> Plan:
    """Cut a mesh between the floor and ``top_m``; triangles that pass either are cut."""
    bottom_m = floor_m(mesh.vertices_m[mesh.faces]) + ABOVE_FLOOR_M
    vertices, faces = mesh
    for normal_z, height_m in ((1.0, bottom_m), (-1.0, top_m)):
        vertices, faces, _ = slice_faces_plane(
            vertices, faces, plane_normal=[0, 0, normal_z], plane_origin=[0, 0, height_m]
        )
    ground = mesh.vertices_m[:, :2]
    return Plan(vertices[faces][:, :, :2], np.stack([ground.min(axis=0), ground.max(axis=0)]))


def floor_m(corners_m: Array) -> float:
    """Estimate the floor's height under triangles (N, 3, 3): 2 % of their area lies below it."""
    height = corners_m[:, :, 2].mean(axis=1)
    order = np.argsort(height)
    covered = np.cumsum(area(corners_m)[order])
    return float(height[order][np.searchsorted(covered, FLOOR_SHARE * covered[-1])])


def draw_plan(axes: Axes, plan: Plan) -> None:
    """Draw the plan to scale, with a bar of one metre below the lower left corner."""
    # Walls are seen edge-on, so edges are drawn as well.
    surface = PolyCollection(list(plan.corners_m), facecolors=GREY, edgecolors=GREY, linewidths=0.7)
    surface.set(zorder=0, rasterized=True)  # tens of thousands of triangles
    axes.add_collection(surface)
    (x0, y0), (x1, y1) = plan.bounds_m
    axes.set_xlim(x0 - 0.15, x1 + 0.15)
    axes.set_ylim(y0 - 0.15, y1 + 0.15)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.plot([x0, x0 + 1.0], [y0 - 0.3] * 2, color="black", linewidth=2, clip_on=False)
    axes.text(x0 + 1.15, y0 - 0.3, "1 m", va="center", fontsize=8)


TICK_M = 0.22
DOT = {"train": 3.0, "test": 7.0}  # square points, of small sets
SMALL_SET = 500  # frames; larger sets have thinner marks


def draw_poses(results: Results) -> Figure | None:
    """Draw the poses of data sets from above: sizes across, scenes down."""
    scenes = {scene: results.sizes(scene) for scene in results.scenes}
    if not scenes:
        return None
    plans = {scene: read_plan(results, scene) for scene in scenes}
    columns = max(map(len, scenes.values()))
    heights = [np.ptp(plan.bounds_m[:, 1]) / np.ptp(plan.bounds_m[:, 0]) for plan in plans.values()]
    size = (0.4 + 2.9 * columns, 0.7 + sum(2.7 * height + 0.55 for height in heights))
    figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(h_pad=0.09))
    panels = figure.subplots(len(scenes), columns, squeeze=False, height_ratios=heights)
    for line, (scene, sizes) in zip(panels, scenes.items(), strict=True):
        for axes in line[len(sizes) :]:
            axes.set_axis_off()
        for axes, name in zip(line, sizes, strict=False):
            tables = {split: results.labels(scene, name, "synfeal", split) for split in SPLITS}
            _draw_set(axes, plans[scene], tables, f"{scene_title(scene)}, {name}")
    look: Style = {"linestyle": "-", "linewidth": 0.8, "markersize": 5}
    handles = [Line2D([], [], **look, **SPLIT_STYLES[split]) for split in SPLITS]
    figure.legend(handles, ["training pose", "test pose"], loc="outside lower center", ncols=2)
    return figure


def view_ticks(table: PoseTable) -> Array:
    """Return segments (N, 2, 2) in world x and y, from each camera along its optical axis.

    A camera that looks steeply up or down has a short tick.
    """
    start = table.position_m[:, :2]
    forward = table.world_from_cam[:, :2, 2]
    return np.stack([start, start + TICK_M * forward], axis=1)


def _draw_set(axes: Axes, plan: Plan, tables: dict[str, PoseTable], title: str) -> None:
    draw_plan(axes, plan)
    for order, (split, table) in enumerate(tables.items(), start=2):
        style = SPLIT_STYLES[split]
        thinner = max(1.0, len(table) / SMALL_SET) ** -0.5
        ticks = LineCollection(
            list(view_ticks(table)), colors=style["color"], linewidths=0.6 * thinner
        )
        ticks.set(rasterized=True, zorder=order, alpha=0.6)
        axes.add_collection(ticks)
        axes.scatter(
            x=table.position_m[:, 0],
            y=table.position_m[:, 1],
            s=DOT[split] * thinner,
            linewidths=0,
            rasterized=True,
            zorder=order + 0.5,
            label=split,
            **style,
        )
    counts = [f"{len(tables[split]):,} {split}" for split in SPLITS]
    axes.set_title(f"{title}\n{' + '.join(counts)} frames", fontsize=9)
