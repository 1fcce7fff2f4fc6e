"""A scene from above: walls and furniture in light grey, under whatever is drawn on top."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from trimesh.intersections import slice_faces_plane
from trimesh.triangles import area

from synfeal.mesh.triangles import Triangles, load_collision_mesh
from synfeal.report.figures.sources import Array, Results

# Dust on a scanned floor and skirting are no furniture.
ABOVE_FLOOR_M = 0.15
GREY = "0.86"
FLOOR_SHARE = 0.02  # of the surface lies below the floor's height: holes dig, a floor is large


@dataclass(frozen=True)
class Plan:
    """What of a scene a plan shows."""

    corners_m: Array  # (N, 3, 2) triangles from above, world x and y
    bounds_m: Array  # (2, 2) lower and upper corner of the whole mesh, world x and y


def read_plan(results: Results, scene: str) -> Plan:
    """The plan of a scene, cut above the highest camera of its true poses."""
    mesh = load_collision_mesh(results.root / "scenes" / scene / "collision.ply")
    largest = results.sizes(scene)[-1]
    return plan_of(mesh, results.labels(scene, largest, "synfeal", "train").position_m[:, 2].max())


def plan_of(mesh: Triangles, top_m: float) -> Plan:
    """What of a mesh lies between the floor and ``top_m``; triangles that pass either are cut."""
    bottom_m = floor_m(mesh.vertices_m[mesh.faces]) + ABOVE_FLOOR_M
    vertices, faces = mesh
    for normal_z, height_m in ((1.0, bottom_m), (-1.0, top_m)):
        plane = {"plane_normal": [0, 0, normal_z], "plane_origin": [0, 0, height_m]}
        vertices, faces, _ = slice_faces_plane(vertices, faces, **plane)
    ground = mesh.vertices_m[:, :2]
    return Plan(vertices[faces][:, :, :2], np.stack([ground.min(axis=0), ground.max(axis=0)]))


def floor_m(corners_m: Array) -> float:
    """Height of the floor under triangles (N, 3, 3): 2 % of their area lies below it."""
    height = corners_m[:, :, 2].mean(axis=1)
    order = np.argsort(height)
    covered = np.cumsum(area(corners_m)[order])
    return float(height[order][np.searchsorted(covered, FLOOR_SHARE * covered[-1])])


def draw_plan(axes: Axes, plan: Plan) -> None:
    """Draw the plan to scale; walls are seen edge-on, so edges are drawn as well."""
    surface = PolyCollection(list(plan.corners_m), facecolors=GREY, edgecolors=GREY, linewidths=0.7)
    surface.set(zorder=0, rasterized=True)  # tens of thousands of triangles
    axes.add_collection(surface)
    (x0, y0), (x1, y1) = plan.bounds_m
    axes.set_xlim(x0 - 0.15, x1 + 0.15)
    axes.set_ylim(y0 - 0.15, y1 + 0.15)
    axes.set_aspect("equal")
    axes.set_axis_off()


def draw_scale_bar(axes: Axes, plan: Plan) -> None:
    """A bar of one metre below the lower left corner."""
    (x0, y0), _ = plan.bounds_m
    axes.plot([x0, x0 + 1.0], [y0 - 0.3] * 2, color="black", linewidth=2, clip_on=False)
    axes.text(x0 + 1.15, y0 - 0.3, "1 m", va="center", fontsize=8)
